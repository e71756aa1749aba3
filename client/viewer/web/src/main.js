import { legendOf } from './channel_colours.js';
import { Connection } from './connection.js';
import { EventList } from './event_list.js';
import { Stage } from './stage.js';

const $ = (id) => document.getElementById(id);
const stage = new Stage($('view'));
const drawn = { frames: 0, since: performance.now(), rate: 0, owed: false };
const events = new EventList($('events'), $('event-count'));
let status = null, lastStep = 0;

const askForValues = () => connection.send({ type: 'values', on: $('values').checked });
const connection = new Connection({
  opened: () => { if ($('values').checked) askForValues(); },  // a new stream knows nothing of it
  topology: (topology) => {
    stage.setTopology(topology);
    showLegend();
  },
  frame: (frame) => {
    if (frame.step < lastStep) events.clear();  // another world
    lastStep = frame.step;
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
    else if (event.kind !== 'topology') events.add(event);  // what is drawn is seen
  },
  error: (error) => events.add({ kind: 'error', step: lastStep, ...error }),
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

// What the colours stand for, while they are shown: a line for each list of channels.
function showLegend() {
  const lists = $('values').checked ? legendOf(stage.bodies) : [];
  $('legend').replaceChildren(...lists.map((channels) => {
    const line = document.createElement('li');
    for (const { name, colour } of channels) {
      const entry = document.createElement('span'), swatch = document.createElement('i');
      swatch.style.background = colour;
      entry.append(swatch, name);
      line.append(entry);
    }
    return line;
  }));
}

const impulse = () => 10 ** Number($('strength').value);
const showStrength = () => { $('strength-value').textContent = `${impulse().toPrecision(2)} N s`; };
$('strength').addEventListener('input', showStrength);
showStrength();

$('play').addEventListener('click', () => connection.send({ type: status?.playing ? 'pause' : 'play' }));
$('step').addEventListener('click', () => connection.send({ type: 'step', count: 1 }));
$('reset').addEventListener('click', () => connection.send({ type: 'restart' }));
$('values').addEventListener('change', () => {
  askForValues();
  showLegend();
});
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

window.crumple = { stage, events };  // for the browser's console and for tests

function draw() {
  stage.render();
  if (drawn.owed) {
    drawn.owed = false;
    connection.grantCredit();
  }
  requestAnimationFrame(draw);
}
draw();
