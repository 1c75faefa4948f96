// Who draws: the processor, until WebGL has drawn the same picture, and in less time.

const kSlowMs = 30; // pictures that take the processor less are no matter
const kFewestHits = 200, kMostWrong = 0.01; // of a band that is compared: its hits, and their part that may differ, at edges
const kWorstDepth = 1e-3, kWorstColour = 8; // in cells, beside the rounding of single precision, and of 255
const kPollMs = 100, kRevivals = 3;
const kLastMode = 3; // of those that show light, colours or normals; false colours are the processor's

export class Choice {
    /// `wanted`: 'webgl' or 'processor' where the page says who draws. `wake`: to be called once WebGL can draw.
    constructor(module, wanted, wake) {
        Object.assign(this, { module, wanted, wake, gpu: null, begun: wanted === 'processor', isPolling: false, revivals: 0 });
        this.chosen = new Set(); // kinds of pictures that WebGL draws
    }
    /// Begins with WebGL where there is any.
    async start() {
        if (this.begun) return;
        this.begun = true;
        try {
            const { Gpu } = await import('./gpu.js');
            this.gpu = Gpu.create(this.wanted === 'webgl');
            this.poll();
        } catch {
            this.gpu = null; // the processor does without
        }
    }
    /// Wakes the loop once the programs for the view are compiled.
    poll() {
        this.isPolling = false;
        if (this.gpu?.isLost()) return this.lose();
        if (this.canDraw(0)) this.wake();
    }
    canDraw(mode) {
        if (this.gpu === null || mode > kLastMode) return false;
        if (this.gpu.isReady(this.module, this.module.gpuKind())) return true;
        if (!this.isPolling) setTimeout(() => this.poll(), kPollMs);
        this.isPolling = true;
        return false;
    }
    /// Does without WebGL.
    end() {
        this.gpu?.close();
        this.gpu = null;
    }
    /// WebGL's context is gone, or did what it should not: the processor draws, and a lost one is tried again.
    lose() {
        const { isWrong } = this.gpu;
        this.end();
        if (isWrong || ++this.revivals > kRevivals) return;
        setTimeout(() => {
            this.begun = false;
            this.start();
        }, 1000 * this.revivals);
    }

    kind() {
        return JSON.stringify(this.module.gpuKind());
    }
    /// Whether WebGL draws the next picture of a view.
    isGpus({ mode }) {
        return (this.wanted === 'webgl' || this.chosen.has(this.kind())) && this.canDraw(mode);
    }
    /// Whether WebGL is to be compared with a whole picture that the processor drew in `ms`.
    isOpen(view, ms) {
        return this.wanted === null && view !== this.judged && ms > kSlowMs && !this.chosen.has(this.kind()) && this.canDraw(view.mode);
    }
    /// Compares it with the picture of a view that is settled and at rest.
    judge(view, ms) {
        this.judged = view;
        this.draw(view, 0, false, true);
        const began = performance.now(), isDrawn = this.gpu !== null && this.draw(view, 0, false, true), took = performance.now() - began;
        if (!isDrawn) return;
        const { hits, wrong } = this.compared(view);
        if (took >= ms || wrong > kMostWrong * hits) this.end();
        else if (hits >= kFewestHits) this.chosen.add(this.kind());
    }
    /// Casts the band in the middle; returns how many of its pixels hit something, and how many WebGL drew otherwise.
    compared(view) {
        const { bands, rows } = this.module.beginSample(0), band = bands >> 1, { cell } = this.module.info();
        const { pixels } = this.module.castBands(view, rows, band, 1, true), depth = this.module.depth(pixels.length / 4);
        const ours = this.gpu.rowsShown(band * rows, depth.length / view.width), bytes = new Uint8Array(ours.colours.buffer);
        let hits = 0, wrong = 0;
        depth.forEach((theirs, i) => {
            const cells = Math.abs(ours.depth[i]), isHit = Number.isFinite(theirs);
            const apart = Math.abs(cells - theirs / cell), isColour = [0, 1, 2].every(k => Math.abs(bytes[4 * i + k] - pixels[4 * i + k]) <= kWorstColour);
            hits += isHit;
            if (!isColour || isHit !== cells < 3e38 || (isHit && !(apart <= kWorstDepth + 1e-6 * cells))) ++wrong;
        });
        return { hits, wrong };
    }

    /// Draws a sample by WebGL: what Gpu.draw() returns; undefined where WebGL was lost.
    draw(view, sample, shows, isSettled) {
        let drawn = null;
        try {
            drawn = this.gpu.draw(this.module, view, sample, shows, isSettled);
        } catch {
            this.gpu.isWrong = true;
        }
        if (drawn || !this.gpu.isLost()) return drawn;
        this.lose();
        return undefined;
    }
}
