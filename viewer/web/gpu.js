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
const kUnread = 0xfffffffe; // what stands where a lost context has read nothing: no record or mark
const kImagesMs = 500; // between copies of images, while more come
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
    /// Returns null where there is no WebGL 2; `anyDevice`: one that is only emulated, or must be waited for while it compiles,
    /// is taken as well.
    static create(anyDevice) {
        const canvas = new OffscreenCanvas(1, 1);
        const gl = canvas.getContext('webgl2', {
            alpha: false, antialias: false, depth: false, stencil: false, powerPreference: 'high-performance',
            failIfMajorPerformanceCaveat: !anyDevice,
        });
        if (!gl || (!anyDevice && (isEmulated(gl) || !gl.getExtension('KHR_parallel_shader_compile')))) return null;
        return new Gpu(canvas, gl);
    }
    constructor(canvas, gl) {
        Object.assign(this, { canvas, gl, programs: new Map(), kinds: new Map(), targets: {}, size: [0, 0], room: [0, 0], layers: 0, imageBytes: 0, imagesAt: -kImagesMs, isWrong: false });
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

    /// A texture without a size, bound where textures are made.
    unfiltered(kind) {
        const { gl } = this, texture = gl.createTexture();
        this.bind(kOwnUnit, texture, kind);
        for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(kind, filter, gl.NEAREST);
        return texture;
    }
    /// `isWide`: of four words a texel, else of one.
    texture(width, height, isWide, words = null) {
        const { gl } = this, texture = this.unfiltered(gl.TEXTURE_2D);
        gl.texStorage2D(gl.TEXTURE_2D, 1, isWide ? gl.RGBA32UI : gl.R32UI, width, height);
        if (words) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, isWide ? gl.RGBA_INTEGER : gl.RED_INTEGER, gl.UNSIGNED_INT, words);
        return { texture, width, height };
    }
    /// A texture of rows, in layers.
    rows(layers, height = kLayerRows) {
        const { gl } = this, texture = this.unfiltered(gl.TEXTURE_2D_ARRAY);
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
        return { framebuffer, parts, wide, width, height };
    }
    release({ framebuffer, parts }) {
        this.gl.deleteFramebuffer(framebuffer);
        for (const { texture } of parts) this.gl.deleteTexture(texture);
    }
    /// Makes the targets that a picture needs; those that are larger stay, for the size follows whether a view moves.
    resize(width, height, { colour, light }, adds) {
        const hasChannels = colour === 3, room = [Math.max(width, this.room[0]), Math.max(height, this.room[1])];
        this.size = [width, height];
        if (room[0] > this.room[0] || room[1] > this.room[1]) {
            Object.values(this.targets).forEach(target => this.release(target));
            this.targets = {};
            this.room = room;
        }
        const make = (name, ...wide) => { this.targets[name] ??= this.target(...room, ...wide); };
        this.targets.starts ??= this.target(...this.tilesOf(room), false);
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
                gl.deleteShader(part); // with the program
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
        if (gl.isContextLost()) return;
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
        this.copyAll(module, this.begin(module, 0), false);
        this.copyBackground(module, 8);
        this.resize(8, 8, kind, true);
        this.passes(kind, programs, 0);
        const shown = this.passes(kind, programs, 1);
        this.drawGrid(programs.probe);
        this.drawMarks(programs.marks);
        this.show(programs.show, shown).close();
        const sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
        gl.flush();
        return sync;
    }

    // What is drawn.

    tilesOf([width, height]) {
        return [Math.ceil(width / 8), Math.ceil(height / 8)];
    }
    /// Draws to a part of a target from its first texel on; of more than so many pixels, in several calls.
    run({ program }, { framebuffer }, [width, height] = this.size) {
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
    copyAll(module, begun, isSettled) {
        this.copyRows(module, begun);
        this.copyTable(module, begun);
        this.copyImages(module, begun, isSettled);
        this.gl.bindBuffer(this.gl.UNIFORM_BUFFER, this.frames);
        this.gl.bufferData(this.gl.UNIFORM_BUFFER, module.gpuConstants(), this.gl.DYNAMIC_DRAW);
        this.gl.bindBufferBase(this.gl.UNIFORM_BUFFER, 0, this.frames);
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
    copyImages(module, { images }, isSettled) {
        const soon = this.imagesNumber > 0 && images > 0 && performance.now() - this.imagesAt < kImagesMs;
        // What is there has tables of its own: until the last have come it is not copied too often.
        if (this.imagesNumber === images || (soon && !isSettled)) return;
        this.imagesAt = performance.now();
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
        this.imageBytes = 4 * count;
        if (images !== 0) module.wasm.vcp_gpu_images_end();
    }
    /// The background is that of all samples of a picture.
    copyBackground(module, height) {
        this.gl.deleteTexture(this.background?.texture ?? null);
        this.background = this.texture(1, height, false, module.wordsAt(module.wasm.vcp_gpu_background(), height));
        this.bind(kUnits.rowColours, this.background.texture);
    }
    /// Begins a sample, with all that it reads in place. Returns null where the picture cannot go on.
    begin(module, sample) {
        if (this.layers === 0) module.wasm.vcp_gpu_forget(); // another context may have had it all
        let begun = module.gpuBegin(sample);
        if (begun && begun.poolRows > this.layers * kLayerRows) {
            const grown = Math.min(Math.floor(1.5 * this.layers), Math.ceil(begun.mostRows / kLayerRows));
            const layers = Math.max(Math.ceil(begun.poolRows / kLayerRows), grown);
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
    draw(module, { width, height }, sample, shows, isSettled) {
        const begun = this.begin(module, sample);
        const programs = begun && this.programsOf(begun, sample > 0);
        if (!programs) return null;
        this.copyAll(module, begun, isSettled);
        if (sample === 0) this.copyBackground(module, height);
        this.resize(width, height, begun, sample > 0);
        const shown = this.passes(begun, programs, sample), grid = this.readGrid(programs.probe);
        const marks = sample === 0 && begun.asksRays ? this.readMarks(programs.marks, begun) : null;
        if (this.gl.getError() !== this.gl.NO_ERROR) this.isWrong = true;
        // A context may be lost before it says so.
        if (this.isLost() || grid[3] === kUnread || marks?.[0] === kUnread) return null;
        if (sample === 0) module.gpuEnd(begun, grid, marks);
        return { picture: shows ? this.show(programs.show, shown) : null, grid };
    }
    /// Draws a sample as large as the targets are; returns the texture that shows it, or the mean of it and those before.
    passes(kind, programs, sample) {
        const { starts, hits, light, first, more } = this.targets, part = sample === 0 ? first : more;
        this.run(programs.beam, starts, this.tilesOf(this.size));
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
    show({ program }, { texture }) {
        const { gl, canvas, size: [width, height] } = this;
        if (canvas.width !== width || canvas.height !== height) canvas.width = width, canvas.height = height;
        this.bind(kUnits.shownTexels, texture);
        gl.useProgram(program);
        gl.uniform2i(gl.getUniformLocation(program, 'size'), width, height);
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.viewport(0, 0, width, height);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        return canvas.transferToImageBitmap();
    }
    drawGrid(made) {
        this.gl.useProgram(made.program);
        this.gl.uniform2i(this.gl.getUniformLocation(made.program, 'grid'), ...kGrid);
        this.gl.uniform2i(this.gl.getUniformLocation(made.program, 'size'), ...this.size);
        this.run(made, this.grid, kGrid);
    }
    /// Waits until all is drawn.
    readGrid(made) {
        this.drawGrid(made);
        return this.read(this.grid, kGrid[0], 0, kGrid[1]);
    }
    drawMarks({ program }) {
        const { gl } = this, { framebuffer, width, height } = this.marksTarget, points = this.size[0] * this.size[1];
        gl.useProgram(program);
        gl.uniform2f(gl.getUniformLocation(program, 'size'), width, height);
        gl.uniform1i(gl.getUniformLocation(program, 'width'), this.size[0]);
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.viewport(0, 0, width, height);
        gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
        for (let first = 0; first < points; first += kMostPixels) {
            gl.drawArrays(gl.POINTS, first, Math.min(kMostPixels, points - first));
            gl.flush();
        }
    }
    readMarks(made, { records }) {
        this.drawMarks(made);
        const words = this.read(this.marksTarget, kRowTexels, 0, this.marksTarget.height);
        return Uint32Array.from({ length: records }, (_, i) => words[4 * i]);
    }
    /// Returns rows of a target's first texture, up to a width; four words a texel.
    read({ framebuffer }, width, first, count) {
        const { gl } = this, words = new Uint32Array(4 * width * count).fill(kUnread);
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.readPixels(0, first, width, count, gl.RGBA_INTEGER, gl.UNSIGNED_INT, words);
        return words;
    }
    /// Returns what rows of the picture drawn last show in its first sample: colours, RGBA8, and depths in cells, below 0
    /// on the cap of a section and 3e38 or more where nothing is hit.
    rowsShown(first, count) {
        const depths = new Float32Array(this.read(this.targets.hits, this.size[0], first, count).buffer);
        const words = this.read(this.targets.first, this.size[0], first, count);
        const every = (array, from) => array.map((_, i) => from[4 * i]);
        return { colours: every(new Uint32Array(words.length / 4), words), depth: every(new Float32Array(words.length / 4), depths) };
    }
    /// Returns how much memory its textures take.
    bytes() {
        const targets = Object.values(this.targets).flatMap(target => target.parts.map((_, i) => (target.wide[i] ? 16 : 4) * target.width * target.height));
        return targets.reduce((sum, one) => sum + one, 16 * kRowTexels * kLayerRows * this.layers + this.imageBytes);
    }
}
