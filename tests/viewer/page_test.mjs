// usage: page_test.mjs BIN ROOT    Exit 0: passed; 77: no browser or no built page; 1: failed.
// Starts crumple-server and crumple-viewer on free ports with the scene of three barrels, loads the page in headless
// Chromium, and claims: pixels stay while the world is paused, a click pushes a body, and pixels change while it runs. Then with the
// scene of the pane: when it breaks, the page makes it anew and nothing else, and goes on drawing. Then with the shipyard: dents are
// coloured by example, with a legend, and what parts and dents is listed, within bounds.
import { execFileSync } from 'node:child_process';
import { Programs, launch, missing } from '../../client/viewer/browse.mjs';

const [bin, root] = process.argv.slice(2);
if (missing(root)) {
  console.log(`SKIPPED: needs ${missing(root)}`);
  process.exit(77);
}
const programs = new Programs(bin);

const claim = (holds, what) => {
  if (!holds) throw new Error(`not so: ${what}`);
  console.log(`ok: ${what}`);
};

async function visit(browser, page) {
  const tab = await browser.newPage();
  await tab.setViewport({ width: 900, height: 640 });
  const errors = [];
  tab.on('pageerror', (error) => errors.push(error.message));
  await tab.goto(page, { waitUntil: 'domcontentloaded', timeout: 60000 });
  return { tab, errors };
}

async function run() {
  const server = await programs.start('crumple-server', ['--listen', '127.0.0.1:0', '--scenes', `${root}/deploy/scenes`], /127\.0\.0\.1:\d+/);
  const page = await programs.start('crumple-viewer', ['--server', server, '--scene', 'barrels.json', '--port', '0'], /http:\/\/\S+/);
  const browser = await launch(root);
  try {
    const { tab, errors } = await visit(browser, page);
    const until = (what, condition, ...args) => tab.waitForFunction(condition, { timeout: 60000, polling: 100 }, ...args)
      .then(() => console.log(`ok: ${what}`));
    // What a person sees, beside the texts at the edges.
    const pixels = () => tab.screenshot({ encoding: 'base64', clip: { x: 240, y: 120, width: 420, height: 500 } });
    const step = () => tab.evaluate(() => Number(document.getElementById('timing').textContent.match(/step\s+(\d+)/)?.[1] ?? -1));
    const click = (id) => tab.evaluate((name) => document.getElementById(name).click(), id);

    await until('frames arrive', () => /step\s+\d+/.test(document.getElementById('timing').textContent));
    await until('the page knows that the world plays', () => document.getElementById('play').textContent === 'Pause');
    const at = await step();
    await until('the world runs', (from) => Number(document.getElementById('timing').textContent.match(/step\s+(\d+)/)[1]) > from + 20, at);

    await click('play');
    await until('the world pauses', () => document.getElementById('play').textContent === 'Play');
    // Frames still on their way come in; then the step stands.
    let stood = await step();
    for (let still = 0; still < 5;) {
      await new Promise((resolve) => setTimeout(resolve, 100));
      const now = await step();
      still = now === stood ? still + 1 : 0;
      stood = now;
    }
    const paused = await pixels();
    claim(paused === await pixels(), 'pixels stay while it is paused');

    // The middle of a barrel on the screen.
    const target = await tab.evaluate(() => {
      const { stage } = window.crumple;
      for (const body of stage.bodies.filter((b) => b.model === 'example_based')) {
        const p = body.mesh.geometry.attributes.position;
        const mean = stage.controls.target.clone().set(0, 0, 0);
        for (let i = 0; i < p.count; ++i) mean.add({ x: p.getX(i) / p.count, y: p.getY(i) / p.count, z: p.getZ(i) / p.count });
        const on = mean.clone().project(stage.camera);
        const x = (on.x + 1) / 2 * window.innerWidth, y = (1 - on.y) / 2 * window.innerHeight;
        const hit = document.elementFromPoint(x, y)?.id === 'view' ? stage.pick(x, y) : null;
        if (hit && hit.id === body.id) return { x, y, hit: { id: hit.id, direction: hit.direction } };
      }
      return { hit: null };
    });
    claim(target.hit !== null, 'a barrel is under the pointer');
    const along = () => tab.evaluate(({ id, direction }) => {
      const p = window.crumple.stage.bodies[id].mesh.geometry.attributes.position;
      let sum = 0;
      for (let i = 0; i < p.count; ++i) sum += (p.getX(i) * direction[0] + p.getZ(i) * direction[2]) / p.count;
      return sum;
    }, target.hit);
    const before = await along();
    await tab.mouse.click(target.x, target.y);
    for (let k = 1; k <= 10; ++k) {
      await click('step');
      await until(`step ${k}`, (wanted) => Number(document.getElementById('timing').textContent.match(/step\s+(\d+)/)[1]) >= wanted, stood + k);
    }
    const after = await along();
    const said = await tab.evaluate(() => document.getElementById('events').textContent);
    claim(after > before + 0.01, `the click pushed the barrel along the line of sight (${before} to ${after} m; ${said})`);
    // By now the barrels may lie still; the one that was pushed does not.
    const pushed = await pixels();
    claim(pushed !== paused, 'pixels change with the steps');
    await click('play');
    let changes = false;
    for (let k = 0; k < 100 && !changes; ++k) changes = await pixels() !== pushed;
    claim(changes, 'pixels change while the world runs');
    claim(errors.length === 0, `the page raised no error ${errors.join('; ')}`);
  } finally {
    await browser.close();
  }
}

async function breaks() {
  const server = await programs.start('crumple-server', ['--listen', '127.0.0.1:0', '--scenes', `${root}/deploy/scenes`], /127\.0\.0\.1:\d+/);
  const crumple = (...words) => execFileSync(`${bin}/crumple`, ['--server', server, '--timeout', '600', ...words]).toString();
  const world = crumple('create', `${root}/deploy/scenes/pane.json`).match(/\d+/)[0];
  const page = await programs.start('crumple-viewer', ['--server', server, '--world', world, '--port', '0'], /http:\/\/\S+/);
  const browser = await launch(root);
  try {
    const { tab, errors } = await visit(browser, page);
    const shown = (step) => tab.waitForFunction((wanted) => Number(document.getElementById('timing').textContent.match(/step\s+(\d+)/)?.[1] ?? -1) >= wanted,
      { timeout: 60000, polling: 100 }, step);
    const drawn = () => tab.evaluate(() => ({ epoch: window.crumple.stage.epoch, bodies: window.crumple.stage.bodies.map((body) => ({
      name: body.name, mesh: body.mesh.uuid, vertices: body.mesh.geometry.attributes.position.count,
      highest: body.mesh.geometry.index.array.reduce((a, b) => Math.max(a, b), -1) })) }));
    await shown(0);
    const whole = await drawn();
    claim(whole.epoch === 0, 'the page begins with the whole pane');
    let broken = whole, step = 0;
    while (broken.epoch === 0 && step < 40) {
      crumple('step', world, '1');
      await shown(++step);
      broken = await drawn();
    }
    claim(broken.epoch > 0, `the pane breaks (step ${step})`);
    crumple('step', world, '20');  // more breaks, of which the page sees the last state alone
    await shown(step + 20);
    const later = await drawn();
    claim(later.epoch > broken.epoch, 'it breaks again');
    for (const [b, body] of whole.bodies.entries()) {
      const same = later.bodies[b].mesh === body.mesh;
      if (same !== (body.name !== 'pane')) throw new Error(`not so: ${body.name} is ${same ? 'as it was' : 'made anew'}`);
    }
    console.log('ok: the pane is made anew and nothing else');
    claim(later.bodies.every((body) => body.highest < body.vertices), 'triangles name vertices that are there');
    claim(errors.length === 0, `the page raised no error ${errors.join('; ')}`);
  } finally {
    await browser.close();
  }
}

async function lists() {
  const server = await programs.start('crumple-server', ['--listen', '127.0.0.1:0', '--scenes', `${root}/deploy/scenes`], /127\.0\.0\.1:\d+/);
  const crumple = (...words) => execFileSync(`${bin}/crumple`, ['--server', server, '--timeout', '600', ...words]).toString();
  const world = crumple('create', 'shipyard.json').match(/\d+/)[0];
  const page = await programs.start('crumple-viewer', ['--server', server, '--world', world, '--port', '0'], /http:\/\/\S+/);
  const browser = await launch(root);
  try {
    const { tab, errors } = await visit(browser, page);
    const until = (what, condition, ...args) => tab.waitForFunction(condition, { timeout: 60000, polling: 100 }, ...args)
      .then(() => console.log(`ok: ${what}`));
    const legend = () => tab.evaluate(() => [...document.querySelectorAll('#legend li')].map((line) => line.innerText));
    await until('the yard is shown', () => /step\s+0/.test(document.getElementById('timing').textContent));
    claim((await legend()).length === 0, 'without values there is no legend');
    await tab.evaluate(() => document.getElementById('values').click());
    await until('values come', () => window.crumple.stage.bodies.some((body) => body.mesh.geometry.attributes.color));
    claim((await legend()).join().includes('crushed_min_x'), 'the legend names the examples');
    // Of a body: [largest difference between a vertex' red, green and blue].
    const colours = () => tab.evaluate(() => {
      let most = 0;
      const { array } = window.crumple.stage.bodies.find((body) => body.name === 'ship').mesh.geometry.attributes.color;
      for (let i = 0; i < array.length; i += 3) most = Math.max(most, Math.max(...array.slice(i, i + 3)) - Math.min(...array.slice(i, i + 3)));
      return most;
    });
    claim(await colours() === 0, 'a ship without a dent is grey');
    crumple('step', world, '700');
    await until('the ship has flown', () => Number(document.getElementById('timing').textContent.match(/step\s+(\d+)/)[1]) >= 700);
    claim(await colours() > 0.1, 'a dented ship has colours of its examples');

    const lines = (kind) => tab.evaluate((wanted) => [...document.querySelectorAll(`#events li[data-kind=${wanted}]`)].map((line) => line.innerText), kind);
    const parted = await lines('parted'), dents = await lines('dent');
    claim(parted.some((text) => /crane 1 part \d parts from .*\(step \d+/.test(text)), `cranes part in the list (${parted[0]})`);
    claim(dents.some((text) => /ship takes a dent of .*, \d+ times\)/.test(text)), `dents of the ship are one line (${dents[0]})`);
    const count = await tab.evaluate(() => {
      const { events } = window.crumple;
      for (let body = 0; body < 500; ++body) events.add({ kind: 'dent', body: 1000 + body, step: 1, message: 'hit' });
      return [document.querySelectorAll('#events li').length, Number(document.getElementById('event-count').textContent)];
    });
    claim(count[0] === 100 && count[1] > 500, `the list is bounded, its count is not (${count})`);
    claim(errors.length === 0, `the page raised no error ${errors.join('; ')}`);
  } finally {
    await browser.close();
  }
}

let failed = false;
try {
  await run();
  await breaks();
  await lists();
} catch (error) {
  failed = true;
  console.log(error.stack ?? String(error));
}
programs.stop();
process.exit(failed ? 1 : 0);
