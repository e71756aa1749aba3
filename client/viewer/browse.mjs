// Starts the programs and a headless Chromium for the page: shared by its test and by picture.mjs.
import { spawn } from 'node:child_process';
import { existsSync } from 'node:fs';
import { createRequire } from 'node:module';

const chromium = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'].find(existsSync);

// What is missing to show the page of this checkout, or null.
export function missing(root) {
  const web = `${root}/client/viewer/web`;
  if (!chromium) return 'Chromium';
  if (!existsSync(`${web}/dist/index.html`)) return 'the built page';
  return existsSync(`${web}/node_modules/puppeteer-core`) ? null : 'the npm package puppeteer-core';
}

export function launch(root) {
  const puppeteer = createRequire(`${root}/client/viewer/web/package.json`)('puppeteer-core');
  return puppeteer.launch({ executablePath: chromium, headless: true, protocolTimeout: 120000,
    args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-first-run',
      '--disable-background-networking', '--disable-component-update', '--disable-sync', '--disable-quic', '--no-proxy-server'] });
}

// Programs of one run; end them all with stop().
export class Programs {
  constructor(bin) {
    this.bin = bin;
    this.children = [];
  }

  // Resolves to the first text of the program's output that matches.
  start(program, args, pattern) {
    return new Promise((resolve, reject) => {
      const child = spawn(`${this.bin}/${program}`, args);
      this.children.push(child);
      let text = '';
      const read = (data) => {
        text += data;
        const found = text.match(pattern);
        if (found) resolve(found[0]);
      };
      child.stdout.on('data', read);
      child.stderr.on('data', read);
      child.on('exit', (code) => reject(new Error(`${program} ended with ${code}: ${text}`)));
    });
  }

  stop() {
    for (const child of this.children) {
      child.removeAllListeners('exit');
      child.kill('SIGTERM');
    }
  }
}
