// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
// usage: node run.mjs PROGRAM.wasm [ARGUMENT...]
// Runs a program as the page does, with the files of this machine: those below the current folder, where an argument names one of
// them, and those below folders that an argument names by an absolute path. What it made or changed is written back when it ends.
// A runner for scripts/golden.sh.
import fs from 'node:fs';
import path from 'node:path';
import vm from 'node:vm';

const { Wasi } = vm.runInThisContext(`${fs.readFileSync(new URL('wasi.js', import.meta.url), 'utf8')}\n;({ Wasi })`);
const [program, ...args] = process.argv.slice(2);
const wasi = new Wasi({ args: [program, ...args], print: bytes => fs.writeSync(1, bytes), say: bytes => fs.writeSync(2, bytes) });

const before = new Map();
function take(folder, to) {
  if (to !== '/') wasi.add(to, null);
  for (const entry of fs.readdirSync(folder, { withFileTypes: true })) {
    const from = path.join(folder, entry.name), place = path.posix.join(to, entry.name);
    if (entry.isDirectory()) take(from, place);
    if (!entry.isFile()) continue;
    const bytes = new Uint8Array(fs.readFileSync(from));
    wasi.add(place, bytes);
    before.set(place, bytes.slice());
  }
}
const folders = args.filter(a => path.isAbsolute(a)).map(a => fs.existsSync(a) && fs.statSync(a).isDirectory() ? a : path.dirname(a));
if (args.some(a => !path.isAbsolute(a) && fs.existsSync(a))) take(process.cwd(), '/');
for (const folder of folders) take(folder, folder);

const name = fs.existsSync(program) ? program : `${program}.wasm`;
const code = wasi.run(new WebAssembly.Module(fs.readFileSync(name)));
for (const [file, bytes] of wasi.files('/')) {
  const place = `/${file}`, known = before.get(place);
  if (known && Buffer.compare(known, bytes) === 0) continue;
  const to = folders.some(f => place.startsWith(`${f}/`)) ? place : path.join(process.cwd(), file);
  fs.mkdirSync(path.dirname(to), { recursive: true });
  fs.writeFileSync(to, bytes);
}
process.exitCode = code;
