// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
'use strict';
// Behind wasi.js, in a worker: runs the tool once for each message and answers with what it printed and wrote.
//   in:  {id, module, args, files: [[path, Blob or Uint8Array]]}; outputs are what the tool leaves in /out
//   out: {id, progress: text} while it works, then
//        {id, code, out, err, outputs: [[path, Uint8Array]], seconds, memory}; code is null where it broke down, or what it says
onmessage = async ({ data: { id, module, args, files } }) => {
  const begin = performance.now(), of_out = new TextDecoder(), of_err = new TextDecoder();
  let out = '', err = '', last = '';
  // The tool's bar is written over its line, in pieces. What is written over goes; the newest bar is told.
  const say = bytes => {
    err = (err + of_err.decode(bytes, { stream: true })).replace(/\r\x1b\[K[^\r\n]*(?=\r\x1b\[K)/g, '');
    const bar = /\r\x1b\[K(.*?) \[[#.]*\] +(\d+) %$/.exec(err);
    if (bar && bar[0] !== last) postMessage({ id, progress: `${bar[1]}: ${bar[2]} %`, percent: +bar[2] });
    if (bar) last = bar[0];
  };
  const wasi = new Wasi({ args, print: bytes => { out += of_out.decode(bytes, { stream: true }); }, say, terminal: true });
  let code = null;
  try {
    for (const [path, source] of files) wasi.add(path, source instanceof Blob ? new Uint8Array(await source.arrayBuffer()) : source);
    wasi.add('/out', null);
    code = wasi.run(module);
  } catch (error) {
    const full = error instanceof RangeError && !/stack/.test(error.message);
    err += `voxelize: ${full ? 'the browser gives no more memory' : 'the program broke down on this model'} (${error.message})\n`;
  }
  err = err.replace(/\r\x1b\[K(.*?\[[#.]*\] +\d+ %)?/g, '');
  const outputs = code === 0 ? wasi.files('/out').map(([path, bytes]) => [path, bytes.slice()]) : [];
  const memory = wasi.memory ? wasi.memory.buffer.byteLength : 0;
  postMessage({ id, code, out, err, outputs, seconds: (performance.now() - begin) / 1000, memory }, outputs.map(([, bytes]) => bytes.buffer));
};
