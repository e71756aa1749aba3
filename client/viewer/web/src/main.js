import { Connection } from './connection.js';
import { Stage } from './stage.js';

const $ = (id) => document.getElementById(id);
const stage = new Stage($('view'));
const drawn = { frames: 0, since: performance.now(), rate: 0, owed: false };
let status = null;

const connection = new Connection({
  topology: (topology) => stage.setTopology(topology),
  frame: (frame) => {
    stage.setFrame(frame);
    drawn.frames += 1;
    drawn.owed = true;
    showTiming(frame);
  },
  status: (next) => {
    status = next;
    $('message').textContent = '';
    $('world').textContent = next.world;
    $('play').textContent = next.playing ? 'Pause' : 'Play';
  },
  event: (event) => {
    if (event.particles) stage.addDust(event);
    else showEvent(event.message);
  },
  error: (error) => showEvent(error.message),
  closed: () => { $('message').textContent = 'No connection to the viewer; trying again'; },
});

function showTiming(frame) {
  const now = performance.now();
  if (now - drawn.since > 500) {
    drawn.rate = 1000 * drawn.frames / (now - drawn.since);
    Object.assign(drawn, { frames: 0, since: now });
  }
  $('timing').textContent = `step      ${frame.step}\ntime      ${frame.time.toFixed(2)} s\n` +
    `step time ${frame.stepMs.toFixed(2)} ms\nreal time ${frame.realTimeFactor.toFixed(2)} x\n` +
    `frames    ${drawn.rate.toFixed(0)} /s\nviewers   ${status ? status.viewers : 1}`;
}

function showEvent(text) {
  const item = document.createElement('li');
  item.textContent = text;
  $('events').append(item);
  while ($('events').children.length > 6) $('events').firstChild.remove();
  setTimeout(() => item.remove(), 6000);
}

const impulse = () => 10 ** Number($('strength').value);
const showStrength = () => { $('strength-value').textContent = `${impulse().toPrecision(2)} N s`; };
$('strength').addEventListener('input', showStrength);
showStrength();

$('play').addEventListener('click', () => connection.send({ type: status?.playing ? 'pause' : 'play' }));
$('step').addEventListener('click', () => connection.send({ type: 'step', count: 1 }));
$('reset').addEventListener('click', () => connection.send({ type: 'restart' }));
$('values').addEventListener('change', () => connection.send({ type: 'values', on: $('values').checked }));
window.addEventListener('keydown', (key) => {
  if (key.target instanceof HTMLInputElement || key.target instanceof HTMLButtonElement) return;
  if (key.key === ' ') $('play').click();
  if (key.key === '.') $('step').click();
});

// A click pushes; a drag orbits.
let pressed = null;
$('view').addEventListener('pointerdown', (at) => { pressed = [at.clientX, at.clientY]; });
$('view').addEventListener('pointerup', (at) => {
  if (!pressed || Math.hypot(at.clientX - pressed[0], at.clientY - pressed[1]) > 4) return;
  const hit = stage.pick(at.clientX, at.clientY);
  if (hit) {
    const size = impulse();
    connection.send({ type: 'push', body: hit.id, point: hit.point, impulse: hit.direction.map((d) => d * size) });
  }
});

window.crumple = { stage };  // for the browser's console and for tests

function draw() {
  stage.render();
  if (drawn.owed) {
    drawn.owed = false;
    connection.grantCredit();
  }
  requestAnimationFrame(draw);
}
draw();
