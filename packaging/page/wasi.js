// SPDX-FileCopyrightText: 2026 The VoxelPipe authors
// SPDX-License-Identifier: Apache-2.0
'use strict';
// The system calls of WASI (wasi_snapshot_preview1) that wasi-libc makes, over files in memory. One program, one thread, one
// folder / that is also the current one. Times of files are not kept.

const errno = { badf: 8, exist: 20, inval: 28, io: 29, isdir: 31, noent: 44, nosys: 52, notdir: 54, notempty: 55, notsup: 58, spipe: 70 };
const kind = { unknown: 0, terminal: 2, folder: 3, file: 4 };
const flag = { create: 1, folder: 2, exclusive: 4, truncate: 8, append: 1 };

class Exit extends Error {
  constructor(code) { super(`exit ${code}`); this.code = code; }
}

// A file's bytes, of which the first `size` are in use.
class MemoryFile {
  constructor(bytes = new Uint8Array(0)) { this.kind = kind.file; this.bytes = bytes; this.size = bytes.length; this.number = ++MemoryFile.count; }
  resize(size) {
    if (size > this.bytes.length) {
      const grown = new Uint8Array(Math.max(size, Math.min(2 * this.bytes.length, this.bytes.length + (1 << 28)), 4096));
      grown.set(this.bytes.subarray(0, this.size));
      this.bytes = grown;
    } else if (size < this.size) {
      this.bytes.fill(0, size, this.size);
    }
    this.size = size;
  }
  read(to, at) {
    const count = Math.max(0, Math.min(to.length, this.size - at));
    to.set(this.bytes.subarray(at, at + count));
    return count;
  }
  write(from, at) {
    if (at + from.length > this.size) this.resize(at + from.length);
    this.bytes.set(from, at);
    return from.length;
  }
  content() { return this.bytes.subarray(0, this.size); }
}
MemoryFile.count = 1;

class MemoryFolder {
  constructor() { this.kind = kind.folder; this.entries = new Map(); this.size = 0; this.number = ++MemoryFile.count; }
}

class Wasi {
  // args: those of main(), the program's name first. print(bytes), say(bytes): what it writes to standard output and error, where
  // it is told that it writes to a terminal if `terminal` is set.
  constructor({ args, print, say, terminal = false }) {
    this.args = args.map(a => new TextEncoder().encode(a + '\0'));
    this.root = new MemoryFolder();
    const out = use => ({ node: { kind: kind.terminal, size: 0, number: 0 }, use, terminal });
    this.open = new Map([[0, { node: new MemoryFile(), at: 0 }], [1, out(print)], [2, out(say)], [3, { node: this.root }]]);
    this.next = 4;
    this.memory = null;
  }

  // ---- files from outside --------------------------------------------------------------------------------------------
  add(path, bytes) {
    const names = path.split('/').filter(Boolean), last = names.pop();
    let folder = this.root;
    for (const name of names) {
      if (!folder.entries.has(name)) folder.entries.set(name, new MemoryFolder());
      folder = folder.entries.get(name);
    }
    folder.entries.set(last, bytes ? new MemoryFile(bytes) : new MemoryFolder());
  }
  // Every file below a folder, with its path from there.
  files(path) {
    const found = [], walk = (folder, before) => {
      for (const [name, node] of folder.entries) {
        if (node.kind === kind.folder) walk(node, `${before}${name}/`);
        else found.push([before + name, node.content()]);
      }
    };
    const { node } = this.find(this.root, path);
    if (node) walk(node, '');
    return found;
  }

  // ---- the program ---------------------------------------------------------------------------------------------------
  // Its exit code. A trap is thrown as WebAssembly.RuntimeError.
  run(module) {
    const calls = {};
    for (const { module: from, name, kind: what } of WebAssembly.Module.imports(module))
      if (from === 'wasi_snapshot_preview1' && what === 'function')
        calls[name] = this[name] ? (...values) => this[name](...values) : () => errno.nosys;
    const instance = new WebAssembly.Instance(module, { wasi_snapshot_preview1: calls });
    this.memory = instance.exports.memory;
    try {
      instance.exports._start();
      return 0;
    } catch (error) {
      if (error instanceof Exit) return error.code;
      throw error;
    }
  }

  // ---- memory --------------------------------------------------------------------------------------------------------
  get view() { return new DataView(this.memory.buffer); }
  bytesAt(at, size) { return new Uint8Array(this.memory.buffer, at >>> 0, size >>> 0); }
  textAt(at, size) { return new TextDecoder().decode(this.bytesAt(at, size).slice()); }
  put32(at, value) { this.view.setUint32(at >>> 0, value, true); return 0; }
  put64(at, value) { this.view.setBigUint64(at >>> 0, BigInt(value), true); return 0; }
  // Each piece of a list of iovec, until use() took less than all of one; the bytes in all.
  pieces(list, count, use) {
    let total = 0;
    for (let i = 0; i < count; ++i) {
      const view = this.view, at = (list >>> 0) + 8 * i, piece = this.bytesAt(view.getUint32(at, true), view.getUint32(at + 4, true));
      const done = use(piece, total);
      total += done;
      if (done < piece.length) break;
    }
    return total;
  }

  // ---- paths ---------------------------------------------------------------------------------------------------------
  // {folder, name, node}: node is missing where there is none, folder where no folder leads to it.
  find(start, path) {
    const way = [start];
    const names = path.split('/').filter(n => n && n !== '.');
    let name = '.', node = start;
    while (names.length) {
      name = names.shift();
      const folder = way[way.length - 1];
      if (name === '..') {
        if (way.length > 1) way.pop();
        node = way[way.length - 1];
        continue;
      }
      node = folder.entries.get(name);
      if (names.length) {
        if (!node) return {};
        if (node.kind !== kind.folder) return { notdir: true };
        way.push(node);
      }
    }
    return { folder: way[way.length - 1], name, node };
  }
  at(fd, path, size, use) {
    const base = this.open.get(fd);
    if (!base || base.node.kind !== kind.folder) return base ? errno.notdir : errno.badf;
    const place = this.find(base.node, this.textAt(path, size));
    if (place.notdir) return errno.notdir;
    return place.folder ? use(place) : errno.noent;
  }
  describe(at, node) {
    this.bytesAt(at, 64).fill(0);
    this.put64(at + 8, node.number);
    this.view.setUint8((at >>> 0) + 16, node.kind);
    this.put64(at + 24, 1); // links
    return this.put64(at + 32, node.size);
  }

  // ---- calls on open files -------------------------------------------------------------------------------------------
  with_file(fd, use) {
    const file = this.open.get(fd);
    return file ? use(file) : errno.badf;
  }
  fd_close(fd) { return this.open.delete(fd) ? 0 : errno.badf; }
  fd_sync(fd) { return this.open.has(fd) ? 0 : errno.badf; }
  fd_datasync(fd) { return this.fd_sync(fd); }
  fd_advise(fd) { return this.fd_sync(fd); }
  fd_filestat_set_times(fd) { return this.fd_sync(fd); }
  fd_allocate() { return errno.notsup; }
  fd_fdstat_get(fd, at) {
    return this.with_file(fd, file => {
      this.bytesAt(at, 24).fill(0);
      const is_stream = file.node.kind === kind.terminal;
      this.view.setUint8(at >>> 0, is_stream && !file.terminal ? kind.unknown : file.node.kind);
      this.view.setUint16((at >>> 0) + 2, file.append ? flag.append : 0, true);
      const rights = is_stream ? 0x40n : 0x1fffffffn; // a stream can be written, not sought: it is a terminal
      this.view.setBigUint64((at >>> 0) + 8, rights, true);
      return this.put64((at >>> 0) + 16, 0x1fffffffn);
    });
  }
  fd_fdstat_set_flags(fd, flags) { return this.with_file(fd, file => { file.append = (flags & flag.append) !== 0; return 0; }); }
  fd_fdstat_set_rights(fd) { return this.fd_sync(fd); }
  fd_filestat_get(fd, at) { return this.with_file(fd, file => this.describe(at, file.node)); }
  fd_filestat_set_size(fd, size) { return this.with_file(fd, file => { file.node.resize(Number(size)); return 0; }); }
  fd_read(fd, list, count, result) {
    return this.with_file(fd, file => {
      if (file.node.kind !== kind.file) return file.node.kind === kind.folder ? errno.isdir : errno.badf;
      const read = this.pieces(list, count, (piece, done) => file.node.read(piece, file.at + done));
      file.at += read;
      return this.put32(result, read);
    });
  }
  fd_pread(fd, list, count, offset, result) {
    return this.with_file(fd, file => this.put32(result, this.pieces(list, count, (piece, done) => file.node.read(piece, Number(offset) + done))));
  }
  fd_write(fd, list, count, result) {
    return this.with_file(fd, file => {
      if (file.use) return this.put32(result, this.pieces(list, count, piece => { file.use(piece.slice()); return piece.length; }));
      if (file.node.kind !== kind.file) return errno.badf;
      if (file.append) file.at = file.node.size;
      return this.stored(() => {
        const written = this.pieces(list, count, (piece, done) => file.node.write(piece, file.at + done));
        file.at += written;
        return this.put32(result, written);
      });
    });
  }
  fd_pwrite(fd, list, count, offset, result) {
    return this.with_file(fd, file => this.stored(() => this.put32(result, this.pieces(list, count, (piece, done) => file.node.write(piece, Number(offset) + done)))));
  }
  // The browser gives no more memory: for the program the disk is full.
  stored(write) {
    try { return write(); } catch (error) {
      if (error instanceof RangeError) return 51; // ENOSPC
      throw error;
    }
  }
  fd_seek(fd, offset, from, result) {
    return this.with_file(fd, file => {
      if (file.node.kind !== kind.file) return errno.spipe;
      const at = Number(offset) + [0, file.at, file.node.size][from];
      if (!(at >= 0)) return errno.inval;
      file.at = at;
      return this.put64(result, at);
    });
  }
  fd_tell(fd, result) { return this.fd_seek(fd, 0n, 1, result); }
  fd_renumber(from, to) {
    return this.with_file(from, file => { this.open.set(to, file); this.open.delete(from); return 0; });
  }
  fd_prestat_get(fd, at) { return fd === 3 ? (this.put32(at, 0), this.put32(at + 4, 1)) : errno.badf; }
  fd_prestat_dir_name(fd, at) { this.bytesAt(at, 1)[0] = 0x2f; return 0; }
  fd_readdir(fd, at, size, cookie, result) {
    return this.with_file(fd, file => {
      if (file.node.kind !== kind.folder) return errno.notdir;
      let used = 0, number = Number(cookie);
      for (const [name, node] of [...file.node.entries].slice(number)) {
        const text = new TextEncoder().encode(name), entry = new Uint8Array(24 + text.length), view = new DataView(entry.buffer);
        view.setBigUint64(0, BigInt(++number), true);
        view.setBigUint64(8, BigInt(node.number), true);
        view.setUint32(16, text.length, true);
        view.setUint8(20, node.kind);
        entry.set(text, 24);
        const part = entry.subarray(0, Math.min(entry.length, size - used));
        this.bytesAt(at + used, part.length).set(part);
        used += part.length;
        if (part.length < entry.length) break;
      }
      return this.put32(result, used);
    });
  }

  // ---- calls on paths ------------------------------------------------------------------------------------------------
  path_open(base, follow, path, size, open_flags, rights, inheriting, fd_flags, result) {
    return this.at(base, path, size, ({ folder, name, node }) => {
      if (node && open_flags & flag.create && open_flags & flag.exclusive) return errno.exist;
      if (!node && !(open_flags & flag.create)) return errno.noent;
      if (!node) folder.entries.set(name, node = new MemoryFile());
      if (open_flags & flag.folder && node.kind !== kind.folder) return errno.notdir;
      if (node.kind === kind.folder && BigInt(rights) & 0x40n) return errno.isdir;
      if (open_flags & flag.truncate && node.kind === kind.file) node.resize(0);
      this.open.set(this.next, { node, at: 0, append: (fd_flags & flag.append) !== 0 });
      return this.put32(result, this.next++);
    });
  }
  path_filestat_get(base, follow, path, size, at) { return this.at(base, path, size, ({ node }) => node ? this.describe(at, node) : errno.noent); }
  path_filestat_set_times(base, follow, path, size) { return this.at(base, path, size, ({ node }) => node ? 0 : errno.noent); }
  path_readlink(base, path, size) { return this.at(base, path, size, ({ node }) => node ? errno.inval : errno.noent); }
  path_create_directory(base, path, size) {
    return this.at(base, path, size, ({ folder, name, node }) => {
      if (node) return errno.exist;
      folder.entries.set(name, new MemoryFolder());
      return 0;
    });
  }
  path_unlink_file(base, path, size) {
    return this.at(base, path, size, ({ folder, name, node }) => {
      if (!node) return errno.noent;
      if (node.kind === kind.folder) return errno.isdir;
      folder.entries.delete(name);
      return 0;
    });
  }
  path_remove_directory(base, path, size) {
    return this.at(base, path, size, ({ folder, name, node }) => {
      if (!node) return errno.noent;
      if (node.kind !== kind.folder) return errno.notdir;
      if (node.entries.size) return errno.notempty;
      folder.entries.delete(name);
      return 0;
    });
  }
  path_rename(base, path, size, other, to, to_size) {
    return this.at(base, path, size, from => {
      if (!from.node) return errno.noent;
      return this.at(other, to, to_size, ({ folder, name }) => {
        from.folder.entries.delete(from.name);
        folder.entries.set(name, from.node);
        return 0;
      });
    });
  }
  path_link() { return errno.notsup; }
  path_symlink() { return errno.notsup; }

  // ---- the rest ------------------------------------------------------------------------------------------------------
  list_sizes(list, count, bytes) { this.put32(count, list.length); return this.put32(bytes, list.reduce((sum, text) => sum + text.length, 0)); }
  list_get(list, pointers, buffer) {
    let at = buffer >>> 0;
    list.forEach((text, i) => {
      this.put32((pointers >>> 0) + 4 * i, at);
      this.bytesAt(at, text.length).set(text);
      at += text.length;
    });
    return 0;
  }
  args_sizes_get(count, bytes) { return this.list_sizes(this.args, count, bytes); }
  args_get(pointers, buffer) { return this.list_get(this.args, pointers, buffer); }
  environ_sizes_get(count, bytes) { return this.list_sizes([], count, bytes); }
  environ_get() { return 0; }
  clock_res_get(clock, result) { return this.put64(result, 1000); }
  clock_time_get(clock, precision, result) {
    const now = clock === 0 ? Date.now() : performance.now();
    return this.put64(result, BigInt(Math.round(now * 1000)) * 1000n);
  }
  random_get(at, size) {
    for (let done = 0; done < size; done += 65536) {
      const part = new Uint8Array(Math.min(65536, size - done)); // at most that many at a time
      crypto.getRandomValues(part);
      this.bytesAt(at + done, part.length).set(part);
    }
    return 0;
  }
  sched_yield() { return 0; }
  proc_exit(code) { throw new Exit(code); }
}
