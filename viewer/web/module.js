// The WebAssembly module: the product's own reader, policy and caster, behind plain functions.
import { decompress } from './fzstd.js';

const kText = new TextEncoder();
const kRecordBytes = 104; // of a CutRecord (wasm/page_copies.h)
const kTileBytes = 16; // of a TileRecord (wasm/image_copies.h)

/// What WASI's library asks of a system. There is a clock and nothing else.
function system(memory) {
    const view = () => new DataView(memory().buffer);
    const refused = () => 52; // ENOSYS
    return new Proxy(
        {
            clock_time_get(clock, precision, to) {
                view().setBigUint64(to, BigInt(Math.round(performance.now() * 1e6)), true);
                return 0;
            },
            environ_sizes_get(count, bytes) {
                view().setUint32(count, 0, true);
                view().setUint32(bytes, 0, true);
                return 0;
            },
            environ_get: () => 0,
            proc_exit(code) {
                throw new Error(`the reader stopped with ${code}`);
            },
        },
        { get: (functions, name) => functions[name] ?? refused },
    );
}

export class Module {
    /// `source`: the module's bytes, an answer of fetch(), or what another instance was compiled to.
    static async load(source) {
        const made = new Module();
        const memory = () => made.wasm.memory;
        const imports = {
            wasi_snapshot_preview1: system(memory),
            vcp: { unzstd: (to, room, from, bytes) => made.unzstd(to, room, from, bytes) },
        };
        const isCompiled = source instanceof WebAssembly.Module;
        const compiled = isCompiled ? source : await WebAssembly.compile(source instanceof Response ? await source.arrayBuffer() : source);
        made.compiled = compiled;
        // Imports are named one by one: an instance does not look into a proxy for what it does not list.
        const wasi = {};
        for (const { module, name } of WebAssembly.Module.imports(compiled))
            if (module === 'wasi_snapshot_preview1') wasi[name] = imports.wasi_snapshot_preview1[name];
        made.wasm = (await WebAssembly.instantiate(compiled, { ...imports, wasi_snapshot_preview1: wasi })).exports;
        made.wasm._initialize?.();
        return made;
    }

    unzstd(to, room, from, bytes) {
        try {
            const frame = new Uint8Array(this.wasm.memory.buffer, from, bytes).slice();
            const content = decompress(frame, new Uint8Array(room));
            if (content.length > room) return -1;
            new Uint8Array(this.wasm.memory.buffer, to, content.length).set(content);
            return content.length;
        } catch {
            return -1;
        }
    }

    /// Calls use(pointer) with a copy of the bytes in the module's memory.
    with(bytes, use) {
        const at = this.wasm.vcp_alloc(Math.max(bytes.byteLength, 8));
        if (at === 0) throw new Error('out of memory');
        new Uint8Array(this.wasm.memory.buffer, at, bytes.byteLength).set(
            new Uint8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength));
        try {
            return use(at);
        } finally {
            this.wasm.vcp_free(at);
        }
    }

    begin(size, name, budgetBytes) {
        this.with(kText.encode(name + '\0'), at => this.wasm.vcp_begin(size, at, budgetBytes));
    }
    supply(offset, bytes) {
        this.with(bytes, at => this.wasm.vcp_supply(offset, at, bytes.byteLength));
    }
    /// Says that the file with the byte at an offset cannot be had, and why.
    lose(offset, why) {
        this.with(kText.encode(why + '\0'), at => this.wasm.vcp_lose(offset, at));
    }
    /// Throws what the module says where a call failed; returns its result.
    checked(result) {
        if (result < 0) throw new Error(this.error());
        return result;
    }
    error() {
        return this.textAt(this.wasm.vcp_error());
    }
    textAt(at) {
        const bytes = new Uint8Array(this.wasm.memory.buffer, at);
        return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
    }
    /// Returns true once header and directory are there.
    open() {
        return this.checked(this.wasm.vcp_open()) === 0;
    }
    missing() {
        const stretches = [];
        for (let i = 0, count = this.wasm.vcp_missing(); i < count; ++i)
            stretches.push({ offset: this.wasm.vcp_missing_offset(i), bytes: this.wasm.vcp_missing_bytes(i) });
        return stretches;
    }
    /// Where a stretch lies: the name of its file, beside the one that was begun with and empty for that one, and the
    /// offset in it.
    placeOf(offset) {
        const number = this.wasm.vcp_file_at(offset);
        return { name: this.textAt(this.wasm.vcp_file_name(number)), offset: offset - this.wasm.vcp_file_begin(number) };
    }
    numbers(at, count) {
        return [...new Float64Array(this.wasm.memory.buffer, at, count)];
    }
    info() {
        const n = this.numbers(this.wasm.vcp_info(), 12);
        return {
            boundsMin: n.slice(0, 3), boundsMax: n.slice(3, 6), cell: n[6], levels: n[7], triangles: n[8],
            certifiedError: n[9], hasColour: n[10] === 1, pages: n[11],
        };
    }
    /// `view`: eye, forward, up, fov (radians, from the lower to the upper edge), width, height; what is left out below
    /// is as here. `light`: towards it, in the camera's axes (right, up, back). `section`: { normal, offset }: what has
    /// dot(normal, x) >= offset is kept. `environment`: 0, or 1 + the number of surroundings (studio, overcast, clear) in
    /// place of the light. `upright`: the axis that points up. `plain`: materials' channels are not shown. `colourError`: ΔE.
    look(view) {
        const { eye, forward, up, fov, width, height, errorPixels = 0.5, mode = 0, shadows = false, occlusionRays = 0,
            top = [0, 0, 0], bottom = [0, 0, 0], light = [-0.35, 0.55, 0.75], section = null, environment = 0,
            upright = [0, 1, 0], plain = false, colourError = 6 } = view;
        const cut = section ? [1, ...section.normal, section.offset] : [0, 0, 0, 0, 0];
        const numbers = [...eye, ...forward, ...up, fov, width, height, errorPixels, mode, Number(shadows), occlusionRays,
            ...top, ...bottom, ...light, ...cut, environment, ...upright,
            Number(!plain), colourError];
        this.with(new Float64Array(numbers), at => this.wasm.vcp_look(at));
    }
    update() {
        const bits = this.checked(this.wasm.vcp_update());
        const n = this.numbers(this.wasm.vcp_numbers(), 8);
        const limitedBy = n[7] > n[0] ? 'colour' : 'geometry';
        return {
            drawable: (bits & 1) !== 0, settled: (bits & 2) !== 0, awaitsRays: (bits & 4) !== 0, changed: (bits & 8) !== 0,
            errorPixels: n[0], residentBytes: n[1], pagesMissing: n[2], pagesInCut: n[3], failures: n[4],
            relaxed: n[5] === 1, problem: n[6] > 0 ? this.error() : null, colourPixels: n[7], limitedBy,
        };
    }
    /// Begins a sample of the view: 0 draws the last update's cut, others add to that picture. Returns how many bands of
    /// how many rows it has, 0 bands where the picture cannot go on, and what others begin the sample with.
    beginSample(sample) {
        return this.begun(this.wasm.vcp_begin_sample(sample));
    }
    begun(result) {
        const bands = this.checked(result);
        const [rows, errorPixels, asksRays, listens] = this.numbers(this.wasm.vcp_numbers(), 4);
        return { bands, rows, errorPixels, asksRays, listens };
    }
    /// Casts `count` bands of `rows` rows from `first` on. Returns the milliseconds that each took and, where it `shows`,
    /// the rows' pixels.
    castBands({ width, height }, rows, first, count, shows) {
        const firstRow = first * rows, lastRow = Math.min(height, (first + count) * rows);
        const pixels = shows ? new Uint8ClampedArray(4 * width * (lastRow - firstRow)) : null, ms = new Float64Array(count);
        for (let band = first; band < first + count; ++band) {
            const began = performance.now(), row = band * rows, bytes = 4 * width * (Math.min(lastRow, row + rows) - row);
            this.wasm.vcp_cast(band);
            if (shows) {
                const at = this.wasm.vcp_colours();
                pixels.set(new Uint8Array(this.wasm.memory.buffer, at, bytes), 4 * width * (row - firstRow));
            }
            ms[band - first] = performance.now() - began;
        }
        return { pixels, ms };
    }
    /// Returns the distances along the rays of the band cast last.
    depth(pixels) {
        return new Float32Array(this.wasm.memory.buffer, this.wasm.vcp_depth(), pixels).slice();
    }
    /// Returns what the rays of the sample said here, for hear().
    said() {
        const count = this.wasm.vcp_said();
        return new Float64Array(this.wasm.memory.buffer, this.wasm.vcp_said_numbers(), count).slice();
    }
    hear(said) {
        this.with(said, at => this.wasm.vcp_hear(at));
    }
    /// What the rays of all bands of sample 0 said counts.
    endSample({ asksRays, listens }) {
        this.wasm.vcp_end_sample(asksRays, listens);
    }

    /// Begins a sample that WebGL draws, as beginSample(). Returns null where the picture cannot go on.
    gpuBegin(sample) {
        if (this.checked(this.wasm.vcp_gpu_begin(sample)) === 0) return null;
        const [copies, poolRows, mostRows, records, version, asksRays, listens, images] = this.numbers(this.wasm.vcp_numbers(), 8);
        return { copies, poolRows, mostRows, records, version, asksRays, listens, images, ...this.gpuKind() };
    }
    /// Returns what shaders are compiled for the view with.
    gpuKind() {
        const [colour, sections, light] = this.numbers(this.wasm.vcp_gpu_kind(), 3);
        return { colour, sections, light };
    }
    /// Returns which rows of the pool's texture are to be copied from the module's memory, and where they are.
    gpuRows({ copies }) {
        const words = this.wordsAt(this.wasm.vcp_gpu_rows(), 4 * copies);
        return Array.from({ length: copies }, (_, i) => ({ first: words[4 * i], count: words[4 * i + 1], address: words[4 * i + 2] }));
    }
    /// Returns the words of the images: how many, and parts of the module's memory that have them.
    gpuImages() {
        const count = this.wasm.vcp_gpu_images(), list = this.wordsAt(this.wasm.vcp_gpu_image_parts(), 2 * count).slice();
        const parts = Array.from({ length: count }, (_, i) => this.wordsAt(list[2 * i], list[2 * i + 1]));
        return { count: parts.reduce((sum, part) => sum + part.length, 0), parts };
    }
    gpuConstants() {
        return this.wordsAt(this.wasm.vcp_gpu_constants(), this.wasm.vcp_gpu_constants_bytes() / 4);
    }
    /// Says that WebGL has drawn sample 0, what the grid of pixels hit, and the marks of pages, or null.
    gpuEnd({ listens }, grid, marks) {
        const heard = listens ? grid : new Uint32Array(), seen = marks ?? new Uint32Array();
        this.with(heard, hits => this.with(seen, at => this.wasm.vcp_gpu_end(hits, heard.length / 4, at, seen.length)));
    }
    /// Words of the module's memory, until it grows.
    wordsAt(address, count) {
        return new Uint32Array(this.wasm.memory.buffer, address, count);
    }

    /// Returns the pages and tiles of images that `count` rows of the picture from `first` on need: `records` and `tiles`
    /// for beginCopied(), and of each its key and where its bytes are. Keys of tiles are below 0.
    needed(first, count) {
        const pages = this.wasm.vcp_needed(first, count);
        const records = this.copyOf(this.wasm.vcp_records(), kRecordBytes * pages), view = new DataView(records.buffer);
        const list = Array.from({ length: pages }, (_, i) => ({
            key: Number(view.getBigUint64(kRecordBytes * i, true)), bytes: view.getUint32(kRecordBytes * i + 92, true),
            address: view.getUint32(kRecordBytes * i + 96, true),
        }));
        const tiles = this.copyOf(this.wasm.vcp_tiles(), kTileBytes * this.wasm.vcp_tiles_count());
        const numbers = new Uint32Array(tiles.buffer);
        for (let i = 0; i < numbers.length; i += 4) {
            const [number, bytes, address] = numbers.subarray(i, i + 3);
            list.push({ key: -1 - number, bytes, address });
        }
        return { records, tiles, list };
    }
    /// Returns what an instance without pages must know of the images, once tiles of them are needed.
    imageTables() {
        return this.copyOf(this.wasm.vcp_tables(), this.wasm.vcp_tables_bytes());
    }
    /// Returns the JPEGs for the browser to decode, each once.
    jpegs() {
        return Array.from({ length: this.wasm.vcp_jpegs() }, (_, i) => {
            const [id, width, height, bytes, address] = new Uint32Array(this.wasm.memory.buffer, this.wasm.vcp_jpeg(i), 5);
            return { id, width, height, bytes: this.copyOf(address, bytes) };
        });
    }
    /// Takes in the texels of a JPEG, RGBA8; null: it cannot be decoded.
    putJpeg(id, texels) {
        this.with(texels ?? new Uint8Array(), at => this.wasm.vcp_put_jpeg(id, at, (texels?.byteLength ?? 0) / 4));
    }
    /// Returns a copy of bytes of the module's memory.
    copyOf(address, bytes) {
        return new Uint8Array(this.wasm.memory.buffer, address, bytes).slice();
    }
    /// Returns what an instance without pages must know of the scan.
    lead() {
        return this.copyOf(this.wasm.vcp_lead(), this.wasm.vcp_lead_bytes());
    }
    /// Begins in such an instance.
    follow(lead) {
        this.with(lead, at => this.wasm.vcp_follow(at));
    }
    /// Begins with images there.
    followImages(tables) {
        this.with(tables, at => this.wasm.vcp_follow_images(at));
    }
    /// Takes the copy of a page or of a tile of an image, by its key.
    take(key, bytes) {
        const at = key >= 0 ? this.wasm.vcp_room(key, bytes.length) : this.wasm.vcp_tile_room(-1 - key);
        new Uint8Array(this.wasm.memory.buffer, at, bytes.length).set(bytes);
    }
    drop(key) {
        if (key >= 0) this.wasm.vcp_drop(key);
        else this.wasm.vcp_tile_drop(-1 - key);
    }
    /// Begins a sample that another instance began, with pages and tiles that were taken.
    beginCopied({ records, tiles }, sample, { errorPixels, asksRays, listens }) {
        return this.with(records, pages => this.with(tiles, at => this.begun(this.wasm.vcp_begin_copied(
            pages, records.length / kRecordBytes, at, tiles.length / kTileBytes, sample, errorPixels, asksRays, listens))));
    }

    pick(x, y) {
        if (this.wasm.vcp_pick(x, y) !== 1) return null;
        const n = this.numbers(this.wasm.vcp_numbers(), 5);
        return { position: n.slice(0, 3), depth: n[3], error: n[4] };
    }
    memoryBytes() {
        return this.wasm.memory.buffer.byteLength;
    }
}
