// Draws with WebGL 2, in the first worker, by the product's shaders (shaders/expand.mjs). A texture mirrors the module's
// pool, a row for each unit of 16 KiB, so that shaders find pages by the same table as elsewhere. One target a pass:
//
//   beam -> starts of tiles -> trace -> hits -> light -> shade -> a sample -> accumulate -> what is shown
//
// The hits of a grid of pixels, and marks of all pages that are hit, are read back for the policy.
import { shader } from './shaders.js';

const kRowTexels = 1024, kLayerRows = 1024; // of a texture of rows
const kOwnUnit = 15; // where textures are made
const kGrid = [24, 16]; // pixels that say what they hit
const kMostPixels = 1 << 18; // of one call: what takes seconds would end the context

/// The units of textures by the names that shaders have for them.
const kUnits = Object.fromEntries(['poolTexels', 'imageTexels', 'tableTexels', 'tileStartTexels', 'hitTexels', 'lightTexels',
    'channelTexels', 'rowColours', 'sumTexels', 'shownTexels', 'partTexels'].map((name, unit) => [name, unit]));

/// Browsers give such contexts even where they are asked not to.
function isEmulated(gl) {
    const name = gl.getExtension('WEBGL_debug_renderer_info')?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER;
    return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(gl.getParameter(name));
}

export class Gpu {
    /// Returns null where there is no WebGL 2; `anyDevice`: one that is only emulated is taken as well.
    static create(anyDevice) {
        const canvas = new OffscreenCanvas(1, 1);
        const gl = canvas.getContext('webgl2', {
            alpha: false, antialias: false, depth: false, stencil: false, powerPreference: 'high-performance',
            failIfMajorPerformanceCaveat: !anyDevice,
        });
        if (!gl || (!anyDevice && isEmulated(gl))) return null;
        return new Gpu(canvas, gl);
    }
    constructor(canvas, gl) {
        Object.assign(this, { canvas, gl, programs: new Map(), targets: {}, size: [0, 0], layers: 0, tableVersion: null, kinds: new Map(), isWrong: false });
        this.parallel = gl.getExtension('KHR_parallel_shader_compile');
        this.frames = gl.createBuffer();
        this.empty = this.texture(1, 1, false);
        this.grid = this.target(...kGrid, true);
        for (const unit of Object.values(kUnits)) this.bind(unit, this.empty.texture);
    }
    /// Gives all memory back.
    close() {
        this.gl.getExtension('WEBGL_lose_context')?.loseContext();
    }
    /// Nothing can be drawn any more.
    isLost() {
        return this.isWrong || this.gl.isContextLost();
    }

    // Textures and targets.

    /// `isWide`: of four words a texel, else of one.
    texture(width, height, isWide, words = null) {
        const { gl } = this, texture = gl.createTexture();
        gl.activeTexture(gl.TEXTURE0 + kOwnUnit);
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
        gl.texStorage2D(gl.TEXTURE_2D, 1, isWide ? gl.RGBA32UI : gl.R32UI, width, height);
        if (words) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, isWide ? gl.RGBA_INTEGER : gl.RED_INTEGER, gl.UNSIGNED_INT, words);
        return { texture, width, height };
    }
    /// A texture of rows, in layers.
    rows(layers, height = kLayerRows) {
        const { gl } = this, texture = gl.createTexture();
        gl.activeTexture(gl.TEXTURE0 + kOwnUnit);
        gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
        gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
        gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
        gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA32UI, kRowTexels, height, layers);
        return texture;
    }
    bind(unit, texture, kind = this.gl.TEXTURE_2D) {
        this.gl.activeTexture(this.gl.TEXTURE0 + unit);
        this.gl.bindTexture(kind, texture);
    }
    /// Something to draw to: textures of a size, of four words or one.
    target(width, height, ...wide) {
        const { gl } = this, framebuffer = gl.createFramebuffer(), parts = wide.map(isWide => this.texture(width, height, isWide));
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        parts.forEach(({ texture }, i) => gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, texture, 0));
        gl.drawBuffers(parts.map((_, i) => gl.COLOR_ATTACHMENT0 + i));
        return { framebuffer, parts, width, height };
    }
    release({ framebuffer, parts }) {
        this.gl.deleteFramebuffer(framebuffer);
        for (const { texture } of parts) this.gl.deleteTexture(texture);
    }
    /// Makes the targets that a picture needs, and lets go those of another size.
    resize(width, height, { colour, light }, adds) {
        const hasChannels = colour === 3;
        if (this.size[0] !== width || this.size[1] !== height) {
            Object.values(this.targets).forEach(target => this.release(target));
            this.targets = {};
            this.size = [width, height];
        }
        const make = (name, ...wide) => { this.targets[name] ??= this.target(width, height, ...wide); };
        this.targets.starts ??= this.target(Math.ceil(width / 8), Math.ceil(height / 8), false);
        // Where the kind of hits changes, the target does.
        if (this.targets.hits && (this.targets.hits.parts.length === 2) !== hasChannels) {
            this.release(this.targets.hits);
            delete this.targets.hits;
        }
        make('hits', ...(hasChannels ? [true, true] : [true]));
        make('first', false);
        if (adds) make('more', false);
        if (light) make('light', false);
        if (adds) make('even', true, false), make('odd', true, false);
    }

    // Programs.

    /// Returns a program, or null while it is compiled. `constants`: by their id.
    program(name, constants = {}, vertices = 'whole') {
        const { gl } = this, key = `${name} ${JSON.stringify(constants)}`;
        let made = this.programs.get(key);
        if (!made) {
            const defined = Object.entries(constants).map(([id, value]) => `#define SPEC_${id} ${value}u\n`).join('');
            const program = gl.createProgram();
            for (const [kind, text] of [[gl.VERTEX_SHADER, shader(`${vertices}.vert`)], [gl.FRAGMENT_SHADER, defined + shader(`${name}.frag`)]]) {
                const part = gl.createShader(kind);
                gl.shaderSource(part, `#version 300 es\n${text}`);
                gl.compileShader(part);
                gl.attachShader(program, part);
            }
            gl.linkProgram(program);
            this.programs.set(key, made = { program, isReady: false });
        }
        if (!made.isReady) {
            if (this.parallel && !gl.getProgramParameter(made.program, this.parallel.COMPLETION_STATUS_KHR)) return null;
            this.finish(made);
        }
        return made.isReady ? made : null;
    }
    finish(made) {
        const { gl } = this, { program } = made;
        if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
            this.isWrong = true;
            return;
        }
        gl.useProgram(program);
        for (const [name, unit] of Object.entries(kUnits)) gl.uniform1i(gl.getUniformLocation(program, name), unit);
        const block = gl.getUniformBlockIndex(program, 'FrameBlock');
        if (block !== gl.INVALID_INDEX) gl.uniformBlockBinding(program, block, 0);
        made.isReady = true;
    }
    /// Returns the programs that draw a picture, or null while some are compiled.
    programsOf({ colour, sections, light }, adds) {
        const programs = {
            beam: this.program('beam'),
            trace: this.program('trace', { 3: colour, 7: sections }),
            shade: this.program('shade', { 3: colour, 7: light }),
            show: this.program('show'),
            probe: this.program('probe'),
            marks: this.program('marks', {}, 'marks'),
        };
        if (light) programs.light = this.program('light');
        if (adds) programs.accumulate = this.program('accumulate');
        return Object.values(programs).every(Boolean) ? programs : null;
    }
    /// Whether pictures of the view that the module looks at can be drawn without waiting; begins with what they need.
    isReady(module, kind) {
        const key = JSON.stringify(kind), programs = this.programsOf(kind, true), known = this.kinds.get(key);
        if (!programs || this.isLost()) return false;
        if (!known) this.kinds.set(key, this.warm(module, kind, programs));
        else if (known !== true && this.gl.getSyncParameter(known, this.gl.SYNC_STATUS) === this.gl.SIGNALED) {
            this.gl.deleteSync(known);
            this.kinds.set(key, true);
        }
        return known === true;
    }
    /// Draws a tile by each program: many devices compile when they draw first, and nobody is to wait for that. Returns
    /// what is signalled when it is through.
    warm(module, kind, programs) {
        const { gl } = this;
        this.copyAll(module, this.begin(module, 0), 8);
        this.resize(8, 8, kind, true);
        this.passes(kind, programs, 0);
        this.passes(kind, programs, 1);
        const sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
        gl.flush();
        return sync;
    }

    // What is drawn.

    /// Draws to a target; of more than so many pixels, in several calls.
    run({ program }, { framebuffer, width, height }) {
        const { gl } = this, step = Math.max(8, Math.floor(kMostPixels / width / 8) * 8);
        gl.useProgram(program);
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.viewport(0, 0, width, height);
        gl.enable(gl.SCISSOR_TEST);
        for (let row = 0; row < height; row += step) {
            gl.scissor(0, row, width, Math.min(step, height - row));
            gl.drawArrays(gl.TRIANGLES, 0, 3);
            gl.flush();
        }
        gl.disable(gl.SCISSOR_TEST);
    }
    copyAll(module, begun, height) {
        this.copyRows(module, begun);
        this.copyTable(module, begun);
        this.copyImages(module, begun);
        this.copyFrame(module, height);
    }
    copyRows(module, begun) {
        const { gl } = this;
        gl.activeTexture(gl.TEXTURE0 + kUnits.poolTexels);
        for (let { first, count, address } of module.gpuRows(begun)) {
            // Layer by layer.
            while (count > 0) {
                const row = first % kLayerRows, rows = Math.min(count, kLayerRows - row);
                const words = module.wordsAt(address, 4 * kRowTexels * rows);
                gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, row, Math.floor(first / kLayerRows), kRowTexels, rows, 1, gl.RGBA_INTEGER,
                    gl.UNSIGNED_INT, words);
                first += rows, count -= rows, address += 16 * kRowTexels * rows;
            }
        }
    }
    copyTable(module, { version, records }) {
        if (this.tableVersion === version) return;
        const rows = Math.ceil(3 * records / kRowTexels), words = new Uint32Array(4 * kRowTexels * rows);
        words.set(module.wordsAt(module.wasm.vcp_gpu_table(), 12 * records));
        this.gl.deleteTexture(this.table?.texture ?? null);
        this.table = this.texture(kRowTexels, rows, true, words);
        this.bind(kUnits.tableTexels, this.table.texture);
        this.tableVersion = version;
        if (this.marksTarget?.height !== Math.ceil(records / kRowTexels)) {
            if (this.marksTarget) this.release(this.marksTarget);
            this.marksTarget = this.target(kRowTexels, Math.ceil(records / kRowTexels), false);
        }
    }
    /// Copies the images, all of them when any have come.
    copyImages(module, { images }) {
        if (this.imagesNumber === images) return;
        const { gl } = this, { count, parts } = images === 0 ? { count: 1, parts: [] } : module.gpuImages();
        const most = 4 * kRowTexels * kLayerRows, layers = Math.ceil(count / most);
        gl.deleteTexture(this.images ?? null);
        this.images = this.rows(layers, layers > 1 ? kLayerRows : Math.ceil(count / (4 * kRowTexels)));
        let layer = 0, filled = 0, words = new Uint32Array(Math.min(most, 4 * kRowTexels * Math.ceil(count / (4 * kRowTexels))));
        const put = () => {
            gl.activeTexture(gl.TEXTURE0 + kOwnUnit);
            gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer++, kRowTexels, Math.ceil(filled / (4 * kRowTexels)), 1, gl.RGBA_INTEGER,
                gl.UNSIGNED_INT, words);
            filled = 0;
        };
        for (let part of parts)
            while (part.length > 0) {
                const step = Math.min(part.length, most - filled);
                words.set(part.subarray(0, step), filled);
                part = part.subarray(step);
                filled += step;
                if (filled === most) put();
            }
        if (filled > 0) put();
        this.bind(kUnits.imageTexels, this.images, gl.TEXTURE_2D_ARRAY);
        this.imagesNumber = images;
        if (images !== 0) module.wasm.vcp_gpu_images_end();
    }
    copyFrame(module, height) {
        const { gl } = this;
        gl.bindBuffer(gl.UNIFORM_BUFFER, this.frames);
        gl.bufferData(gl.UNIFORM_BUFFER, module.wordsAt(module.wasm.vcp_gpu_constants(), 152), gl.DYNAMIC_DRAW);
        gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, this.frames);
        gl.deleteTexture(this.background?.texture ?? null);
        this.background = this.texture(1, height, false, module.wordsAt(module.wasm.vcp_gpu_background(), height).slice());
        this.bind(kUnits.rowColours, this.background.texture);
    }
    /// Begins a sample, with all that it reads in place. Returns null where the picture cannot go on.
    begin(module, sample) {
        if (this.layers === 0) module.wasm.vcp_gpu_forget(); // another context may have had it all
        let begun = module.gpuBegin(sample);
        if (begun && begun.poolRows > this.layers * kLayerRows) {
            const layers = Math.max(Math.ceil(begun.poolRows / kLayerRows), Math.floor(1.5 * this.layers));
            this.gl.deleteTexture(this.pool ?? null);
            this.pool = this.rows(layers);
            this.layers = layers;
            this.bind(kUnits.poolTexels, this.pool, this.gl.TEXTURE_2D_ARRAY);
            module.wasm.vcp_gpu_forget();
            begun = module.gpuBegin(sample);
        }
        return begun;
    }

    /// Draws a sample of a view: 0 begins a picture. Returns null where it cannot go on, or cannot be drawn; else the
    /// picture, where it `shows`, and what the grid of pixels hit: depth in cells and record plus 1, four words each.
    draw(module, { width, height }, sample, shows) {
        const begun = this.begin(module, sample);
        const programs = begun && this.programsOf(begun, sample > 0);
        if (!programs) return null;
        this.copyAll(module, begun, height);
        this.resize(width, height, begun, sample > 0);
        const shown = this.passes(begun, programs, sample), grid = this.readGrid(programs.probe);
        if (sample === 0) module.gpuEnd(begun, grid, begun.asksRays ? this.readMarks(programs.marks, begun) : null);
        if (this.gl.getError() !== this.gl.NO_ERROR) this.isWrong = true;
        if (this.isLost()) return null;
        return { picture: shows ? this.show(programs.show, shown) : null, grid };
    }
    /// Draws a sample as large as the targets are; returns the texture that shows it, or the mean of it and those before.
    passes(kind, programs, sample) {
        const { starts, hits, light, first, more } = this.targets, part = sample === 0 ? first : more;
        this.run(programs.beam, starts);
        this.bind(kUnits.tileStartTexels, starts.parts[0].texture);
        this.run(programs.trace, hits);
        this.bind(kUnits.hitTexels, hits.parts[0].texture);
        this.bind(kUnits.channelTexels, (hits.parts[1] ?? this.empty).texture);
        this.bind(kUnits.lightTexels, this.empty.texture);
        if (kind.light) {
            this.run(programs.light, light);
            this.bind(kUnits.lightTexels, light.parts[0].texture);
        }
        this.run(programs.shade, part);
        return sample === 0 ? part.parts[0] : this.add(programs.accumulate, sample, part);
    }
    /// Adds a sample to those before it; returns what is shown of them.
    add(program, sample, part) {
        const { even, odd } = this.targets, to = sample % 2 === 0 ? even : odd, before = sample % 2 === 0 ? odd : even;
        this.bind(kUnits.partTexels, part.parts[0].texture);
        this.bind(kUnits.sumTexels, before.parts[0].texture);
        this.bind(kUnits.shownTexels, sample === 1 ? this.targets.first.parts[0].texture : before.parts[1].texture);
        this.run(program, to);
        return to.parts[1];
    }
    show({ program }, { texture, width, height }) {
        const { gl, canvas } = this;
        if (canvas.width !== width || canvas.height !== height) canvas.width = width, canvas.height = height;
        this.bind(kUnits.shownTexels, texture);
        gl.useProgram(program);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.viewport(0, 0, width, height);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        return canvas.transferToImageBitmap();
    }
    /// Waits until all is drawn.
    readGrid(made) {
        const { gl } = this, words = new Uint32Array(4 * kGrid[0] * kGrid[1]);
        gl.useProgram(made.program);
        gl.uniform2f(gl.getUniformLocation(made.program, 'grid'), ...kGrid);
        this.run(made, this.grid);
        gl.readPixels(0, 0, ...kGrid, gl.RGBA_INTEGER, gl.UNSIGNED_INT, words);
        return words;
    }
    readMarks({ program }, { records }) {
        const { gl } = this, { framebuffer, width, height } = this.marksTarget, words = new Uint32Array(4 * width * height);
        gl.useProgram(program);
        gl.uniform2f(gl.getUniformLocation(program, 'size'), width, height);
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.viewport(0, 0, width, height);
        gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
        gl.drawArrays(gl.POINTS, 0, this.size[0] * this.size[1]);
        gl.readPixels(0, 0, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, words);
        return Uint32Array.from({ length: records }, (_, i) => words[4 * i]);
    }
    /// Returns the depths of the picture drawn last, in cells; 0 and above 3e38 where nothing is hit.
    depths() {
        const { gl } = this, [width, height] = this.size, words = new Uint32Array(4 * width * height);
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.targets.hits.framebuffer);
        gl.readPixels(0, 0, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, words);
        const floats = new Float32Array(words.buffer);
        return Float32Array.from({ length: width * height }, (_, i) => floats[4 * i]);
    }
}
