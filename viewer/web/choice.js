// Who draws: the processor, until WebGL has drawn the same picture, and in less time.

const kChecked = [4, 4], kMostWrong = 1; // pixels that are compared, and how many may be on the other side of an edge
const kWorst = 1e-3; // depth that may be between the two, in cells
const kPollMs = 100, kRevivals = 3;
const kLastMode = 3; // of those that show light, colours or normals; false colours are the processor's

export class Choice {
    /// `wanted`: 'webgl' or 'processor' where the page says who draws. `wake`: to be called once WebGL can draw.
    constructor(module, wanted, wake) {
        Object.assign(this, { module, wanted, wake, gpu: null, isChosen: wanted === 'webgl', isJudged: wanted === 'webgl', isPolling: false, revivals: 0 });
    }
    /// Begins with WebGL where there is any.
    async start() {
        if (this.wanted === 'processor' || this.begun) return;
        this.begun = true;
        const { Gpu } = await import('./gpu.js');
        this.gpu = Gpu.create(this.wanted === 'webgl');
        this.poll();
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
    /// WebGL's context is gone, or it does what it should not: the processor draws, and WebGL is tried again.
    lose() {
        const { isWrong } = this.gpu;
        this.end();
        if (isWrong || ++this.revivals > kRevivals) return;
        this.begun = false;
        setTimeout(() => this.start(), 1000 * this.revivals);
    }

    /// Whether WebGL draws the next picture of a view.
    isGpus({ mode }) {
        return this.isChosen && this.canDraw(mode);
    }
    /// Whether WebGL is to be compared with a picture that the processor drew.
    isOpen({ mode }) {
        return !this.isJudged && this.canDraw(mode);
    }
    /// Compares it with what the processor drew of the view in `ms`.
    judge(view, ms) {
        this.isJudged = true;
        if (!this.gpu.draw(this.module, view, 0, false)) return this.end();
        const began = performance.now(), again = this.gpu.draw(this.module, view, 0, false);
        this.isChosen = again !== null && performance.now() - began < ms && this.isRight(view, again.grid);
        if (!this.isChosen) this.end();
    }
    /// Does without WebGL.
    end() {
        this.gpu.close();
        this.gpu = null;
    }
    isRight({ width, height }, grid) {
        const floats = new Float32Array(grid.buffer), { cell } = this.module.info();
        let wrong = 0;
        for (let i = 0; i < kChecked[0] * kChecked[1]; ++i) {
            // Of the grid of 24 x 16 pixels those in the middles of 4 x 4 parts.
            const x = 3 + 6 * (i % kChecked[0]), y = 2 + 4 * Math.floor(i / kChecked[0]), at = 4 * (24 * y + x);
            const hit = this.module.pick(Math.floor((x + 0.5) * width / 24), Math.floor((y + 0.5) * height / 16));
            const depth = Math.abs(floats[at]), isHit = grid[at + 3] !== 0;
            if (isHit !== (hit !== null) || (isHit && Math.abs(depth - hit.depth / cell) > kWorst * Math.max(1, depth * 1e-3))) ++wrong;
        }
        return wrong <= kMostWrong;
    }

    /// Draws a sample by WebGL: what Gpu.draw() returns; undefined where WebGL was lost.
    draw(view, sample, shows) {
        const drawn = this.gpu.draw(this.module, view, sample, shows);
        if (!drawn && this.gpu.isLost()) {
            this.lose();
            return undefined;
        }
        return drawn;
    }
}
