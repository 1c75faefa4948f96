// The WebAssembly module: the product's own reader, policy and caster, behind plain functions.
import { decompress } from './fzstd.js';

const kText = new TextEncoder();

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
    /// `source`: the module's bytes, or an answer of fetch().
    static async load(source) {
        const made = new Module();
        const memory = () => made.wasm.memory;
        const imports = {
            wasi_snapshot_preview1: system(memory),
            vcp: { unzstd: (to, room, from, bytes) => made.unzstd(to, room, from, bytes) },
        };
        const compiled = await WebAssembly.compile(source instanceof Response ? await source.arrayBuffer() : source);
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
    /// Throws what the module says where a call failed; returns its result.
    checked(result) {
        if (result < 0) throw new Error(this.error());
        return result;
    }
    error() {
        const bytes = new Uint8Array(this.wasm.memory.buffer, this.wasm.vcp_error());
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
    /// dot(normal, x) >= offset is kept.
    look(view) {
        const { eye, forward, up, fov, width, height, errorPixels = 0.5, mode = 0, shadows = false, occlusionRays = 0,
            top = [0, 0, 0], bottom = [0, 0, 0], light = [-0.35, 0.55, 0.75], section = null } = view;
        const cut = section ? [1, ...section.normal, section.offset] : [0, 0, 0, 0, 0];
        const numbers = [...eye, ...forward, ...up, fov, width, height, errorPixels, mode, Number(shadows), occlusionRays,
            ...top, ...bottom, ...light, ...cut];
        this.with(new Float64Array(numbers), at => this.wasm.vcp_look(at));
    }
    update() {
        const bits = this.checked(this.wasm.vcp_update());
        const n = this.numbers(this.wasm.vcp_numbers(), 7);
        return {
            drawable: (bits & 1) !== 0, settled: (bits & 2) !== 0, awaitsRays: (bits & 4) !== 0, changed: (bits & 8) !== 0,
            errorPixels: n[0], residentBytes: n[1], pagesMissing: n[2], pagesInCut: n[3], failures: n[4],
            relaxed: n[5] === 1, problem: n[6] > 0 ? this.error() : null,
        };
    }
    render() {
        this.checked(this.wasm.vcp_render());
    }
    refine() {
        return this.checked(this.wasm.vcp_refine());
    }
    /// Returns a copy of the picture.
    picture(width, height) {
        const at = this.wasm.vcp_picture();
        return new Uint8ClampedArray(this.wasm.memory.buffer, at, 4 * width * height).slice();
    }
    depth(width, height) {
        return new Float32Array(this.wasm.memory.buffer, this.wasm.vcp_depth(), width * height).slice();
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
