// Pictures of a scene at some of its steps, as the page draws it.
// usage: node client/viewer/picture.mjs SCENE OUT STEP... [--values] [--near F] [--look X,Y,Z,X,Y,Z] [--size W,H] [--bin DIR]
//   SCENE   a scene file of deploy/scenes      OUT   names OUT_<step>.png
//   --values  in the colours of stress and examples   --near  part of the way to what the page looks at (0 to 0.9)
//   --look  from the first point at the second [m]; comes after --near      --size  of a picture [px]
//   --bin   folder of the programs (build/release/bin)
import { execFileSync } from 'node:child_process';
import { dirname, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { Programs, launch, missing } from './browse.mjs';

const root = resolve(dirname(fileURLToPath(import.meta.url)), '../..');
const args = process.argv.slice(2);
const option = (name, count) => (args.includes(name) ? args.splice(args.indexOf(name), count).at(-1) : null);
const values = option('--values', 1);
const near = Number(option('--near', 2) ?? 0);
const look = option('--look', 2)?.split(',').map(Number);
const [width, height] = (option('--size', 2) ?? '1000,640').split(',').map(Number);
const bin = option('--bin', 2) ?? `${root}/build/release/bin`;
const [scene, out, ...steps] = args;
if (!steps.length || steps.some((step) => !/^\d+$/.test(step)) || !(width > 0 && height > 0) || (look && (look.length !== 6 || !look.every(isFinite)))) {
  console.error('usage: picture.mjs SCENE OUT STEP... [--values] [--near F] [--look X,Y,Z,X,Y,Z] [--size W,H] [--bin DIR]');
  process.exit(2);
}
if (missing(root)) throw new Error(`needs ${missing(root)}: deploy/setup.sh --browser && deploy/build.sh`);

const programs = new Programs(bin);
let browser;
try {
  const server = await programs.start('crumple-server', ['--listen', '127.0.0.1:0', '--threads', '2', '--scenes', `${root}/deploy/scenes`], /127\.0\.0\.1:\d+/);
  const crumple = (...words) => execFileSync(`${bin}/crumple`, ['--server', server, '--timeout', '600', ...words]).toString();
  const world = crumple('create', scene).match(/\d+/)[0];
  const page = await programs.start('crumple-viewer', ['--server', server, '--world', world, '--port', '0'], /http:\/\/\S+/);
  browser = await launch(root);
  const tab = await browser.newPage();
  await tab.setViewport({ width, height });
  await tab.goto(`${page}?fine`, { waitUntil: 'domcontentloaded', timeout: 60000 });
  await tab.addStyleTag({ content: '#bar, #log, #timing { display: none } #legend { top: 8px }' });
  if (values) await tab.evaluate(() => document.getElementById('values').click());
  await tab.waitForFunction(() => /step/.test(document.getElementById('timing').textContent), { timeout: 60000 });
  await tab.evaluate((part) => {
    const { camera, controls } = window.crumple.stage;
    camera.position.lerp(controls.target, part);
    controls.update();
  }, near);
  if (look) {
    await tab.evaluate((at) => {
      const { stage } = window.crumple;
      stage.look(stage.camera.position.clone().fromArray(at), stage.controls.target.clone().fromArray(at, 3));
    }, look);
  }
  let at = 0;
  for (const wanted of steps.map(Number).sort((a, b) => a - b)) {
    if (wanted > at) crumple('step', world, String(wanted - at));
    at = wanted;
    await tab.waitForFunction((step) => Number(document.getElementById('timing').textContent.match(/step\s+(\d+)/)?.[1] ?? -1) >= step,
      { timeout: 120000, polling: 100 }, wanted);
    await new Promise((drawn) => setTimeout(drawn, 1500));
    await tab.screenshot({ path: `${out}_${wanted}.png` });
    console.log(`${out}_${wanted}.png`);
  }
} finally {
  await browser?.close();
  programs.stop();
}
