// <vcp-viewer src="scan.vcp">: a scan in a page, streamed and drawn by a worker.
import { Orbit, kFieldOfView, difference, length } from './camera.js';

const kModes = { lit: 0, clay: 1, unlit: 2, normals: 3, level: 7, error: 8 };
const kMovingScale = 0.4; // of the resolution, while the view moves
const kRestMs = 160;      // without a movement: the view is at rest
const kMostPixels = 1.6e6;
const kPhoneBudget = 64 << 20, kBudget = 192 << 20; // of decoded pages; the module takes at most as much again

const kTheme = {
    dark: { top: [0.10, 0.12, 0.15], bottom: [0.25, 0.27, 0.30] },
    light: { top: [0.78, 0.81, 0.85], bottom: [0.92, 0.93, 0.95] },
};

const kStyle = `
:host { display: block; position: relative; width: 100%; height: 100%; min-height: 160px; overflow: hidden;
    font: 14px/1.4 Inter, system-ui, sans-serif; --ground: #f6f7f9; --raised: #ffffffe8; --control: #e6e9ee;
    --hovered: #d6dbe2; --line: #d9dde3; --ink: #1b1f26; --dim: #5d6673; --accent: #0b66d6; --problem: #c62f21;
    background: var(--ground); color: var(--ink); color-scheme: light; }
:host([data-theme="dark"]) { --ground: #1a1c20; --raised: #24272de8; --control: #30343b; --hovered: #3c424b;
    --line: #32363d; --ink: #eceef1; --dim: #9aa2ad; --accent: #4da3ff; --problem: #ff6b5e; color-scheme: dark; }
canvas { position: absolute; inset: 0; width: 100%; height: 100%; touch-action: none; cursor: grab; }
canvas:active { cursor: grabbing; }
canvas:focus-visible { outline: 2px solid var(--accent); outline-offset: -2px; }
:host([data-tool="measure"]) canvas { cursor: crosshair; }
svg { position: absolute; inset: 0; width: 100%; height: 100%; pointer-events: none; }
svg line { stroke: #000; stroke-opacity: .55; stroke-width: 4; stroke-linecap: round; }
svg line + line { stroke: #ffd24d; stroke-opacity: 1; stroke-width: 2; }
svg circle { fill: #ffd24d; stroke: #0009; stroke-width: 1.5; }
.bar { position: absolute; left: 50%; bottom: max(14px, env(safe-area-inset-bottom)); transform: translateX(-50%);
    display: flex; gap: 4px; padding: 5px; border-radius: 12px; background: var(--raised); border: 1px solid var(--line);
    backdrop-filter: blur(10px); box-shadow: 0 4px 18px #0003; max-width: calc(100% - 16px); }
button, select { font: inherit; font-weight: 500; color: var(--ink); background: transparent; border: 0; border-radius: 8px;
    height: 38px; min-width: 38px; padding: 0 11px; cursor: pointer; white-space: nowrap; }
select { background: var(--control); }
button:hover, select:hover { background: var(--hovered); }
button[aria-pressed="true"] { background: var(--accent); color: #fff; }
:host([data-theme="dark"]) button[aria-pressed="true"] { color: #06192e; }
button:focus-visible, select:focus-visible { outline: 2px solid var(--accent); }
.status { position: absolute; left: 14px; top: 12px; padding: 5px 11px; border-radius: 9px; background: var(--raised);
    color: var(--dim); font-size: 13px; font-variant-numeric: tabular-nums; max-width: calc(100% - 50px); }
.status[data-problem] { color: var(--problem); font-weight: 500; }
.status:empty { display: none; }
.scale { position: absolute; left: 16px; bottom: 22px; font-size: 12px; color: var(--ink); pointer-events: none;
    border: 2px solid currentColor; border-top: 0; height: 6px; box-sizing: border-box; text-align: center; }
.scale span { position: absolute; left: 0; right: 0; bottom: 8px; white-space: nowrap; }
.note { position: absolute; transform: translate(-50%, -50%); width: 26px; height: 26px; min-width: 0; padding: 0;
    border-radius: 50%; background: var(--accent); color: #fff; font-size: 13px; font-weight: 600; box-shadow: 0 1px 6px #0006; }
.card { position: absolute; right: 14px; top: 12px; width: min(300px, calc(100% - 28px)); box-sizing: border-box;
    padding: 14px 16px; border-radius: 12px; background: var(--raised); border: 1px solid var(--line); }
.card h2 { margin: 0 0 4px; font-size: 15px; } .card p { margin: 0; color: var(--dim); }
.corners { display: block; width: 15px; height: 15px; background:
    linear-gradient(currentColor 0 0) 0 0 / 6px 2px, linear-gradient(currentColor 0 0) 0 0 / 2px 6px,
    linear-gradient(currentColor 0 0) 100% 0 / 6px 2px, linear-gradient(currentColor 0 0) 100% 0 / 2px 6px,
    linear-gradient(currentColor 0 0) 0 100% / 6px 2px, linear-gradient(currentColor 0 0) 0 100% / 2px 6px,
    linear-gradient(currentColor 0 0) 100% 100% / 6px 2px, linear-gradient(currentColor 0 0) 100% 100% / 2px 6px;
    background-repeat: no-repeat; }
@media (max-width: 620px) { .scale { bottom: 78px; } .bar button, .bar select { padding: 0 9px; } }
@media (prefers-reduced-motion: reduce) { * { transition: none !important; } }
`;

const kMarkup = `
<canvas tabindex="0" role="application"
    aria-label="Three-dimensional view. Arrow keys turn, plus and minus zoom, shift and arrow keys move, F fits."></canvas>
<svg aria-hidden="true"></svg>
<div class="notes"></div>
<div class="status" role="status" aria-live="polite"></div>
<div class="scale" hidden><span></span></div>
<div class="bar" role="toolbar" aria-label="View">
    <button data-do="fit" title="Show all (F)">Fit</button>
    <select aria-label="Shading"><option value="lit">Lit</option><option value="clay">Clay</option>
        <option value="unlit">Colours</option><option value="normals">Normals</option><option value="level">Levels</option>
        <option value="error">Error</option></select>
    <button data-do="measure" aria-pressed="false" title="Measure a distance (M)">Measure</button>
    <button data-do="link" title="Copy a link to this view">Link</button>
    <button data-do="full" title="Full screen" aria-label="Full screen"><span class="corners"></span></button>
</div>
<div class="card" hidden><h2></h2><p></p></div>`;

/// A length for people: three digits.
function lengthText(x) {
    return x === 0 ? '0' : Number(x.toPrecision(3)).toString();
}

export class VcpViewer extends HTMLElement {
    static observedAttributes = ['src', 'mode', 'annotations', 'theme'];

    constructor() {
        super();
        const root = this.attachShadow({ mode: 'open' });
        root.innerHTML = `<style>${kStyle}</style>${kMarkup}`;
        const find = what => root.querySelector(what);
        this.parts = {
            canvas: find('canvas'), lines: find('svg'), notes: find('.notes'), status: find('.status'), scale: find('.scale'),
            bar: find('.bar'), select: find('select'), card: find('.card'),
        };
        this.orbit = new Orbit();
        this.info = null;
        this.number = 0;
        this.points = []; // of the measurement
        this.notes = [];
        this.picks = new Map();
        this.listen();
    }

    get src() { return this.getAttribute('src'); }
    set src(value) { this.setAttribute('src', value); }
    get mode() { return this.getAttribute('mode') ?? 'lit'; }
    set mode(value) { this.setAttribute('mode', value); }
    /// The camera as text, as in links.
    get camera() { return this.orbit.toText(); }
    set camera(text) { if (this.orbit.fromText(text)) this.moved(); }

    connectedCallback() {
        this.dark = matchMedia('(prefers-color-scheme: dark)');
        this.onScheme = () => { this.chooseTheme(); this.look(false); };
        this.dark.addEventListener('change', this.onScheme);
        this.resizing = new ResizeObserver(() => this.look(false));
        this.resizing.observe(this);
        this.chooseTheme();
        if (this.src) this.open();
    }
    disconnectedCallback() {
        this.dark.removeEventListener('change', this.onScheme);
        this.resizing.disconnect();
        this.worker?.terminate();
        this.worker = null;
    }
    attributeChangedCallback(name, before, now) {
        if (!this.isConnected || before === now) return;
        if (name === 'src') this.open();
        if (name === 'annotations') this.readNotes();
        if (name === 'theme') this.chooseTheme();
        if (name === 'mode') this.parts.select.value = this.mode;
        this.look(false);
    }

    chooseTheme() {
        const theme = this.getAttribute('theme') ?? (this.dark?.matches ? 'dark' : 'light');
        this.dataset.theme = theme === 'dark' ? 'dark' : 'light';
    }

    tell(type, detail) {
        this.dispatchEvent(new CustomEvent(type, { detail, bubbles: true }));
    }
    say(text, isProblem = false) {
        this.parts.status.textContent = text;
        this.parts.status.toggleAttribute('data-problem', isProblem);
        if (isProblem) this.tell('error', { message: text });
    }

    open() {
        this.worker?.terminate();
        this.info = null;
        this.points = [];
        this.say('Opening…');
        this.worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
        this.worker.onmessage = ({ data }) => this.hear(data);
        this.worker.onerror = event => this.say(event.message || 'the viewer could not be loaded', true);
        const isPhone = matchMedia('(pointer: coarse)').matches;
        this.worker.postMessage({
            type: 'open', url: new URL(this.src, document.baseURI).href, wasm: new URL('./vcp.wasm', import.meta.url).href,
            budgetBytes: Number(this.getAttribute('budget')) * 2 ** 20 || (isPhone ? kPhoneBudget : kBudget),
        });
        this.readNotes();
    }

    hear(message) {
        if (message.type === 'opened') {
            this.info = message.info;
            if (!this.info.hasColour) this.parts.select.querySelector('[value="unlit"]')?.remove();
            this.fit();
            const link = /(?:^#|&)vcp=([^&]+)/.exec(location.hash);
            if (link && this.orbit.fromText(decodeURIComponent(link[1]))) this.look(false);
            this.tell('load', { info: this.info });
        } else if (message.type === 'picture') this.show(message);
        else if (message.type === 'settled') {
            if (message.number !== this.number) return;
            this.say('');
            this.tell('settled', message.update);
        } else if (message.type === 'picked') {
            this.picks.get(message.id)?.(message.hit);
            this.picks.delete(message.id);
        } else if (message.type === 'problem' || message.type === 'error') this.say(message.message, true);
    }

    show({ width, height, pixels, number, samples, update, fetched, memoryBytes }) {
        const { canvas } = this.parts;
        if (canvas.width !== width || canvas.height !== height) {
            canvas.width = width;
            canvas.height = height;
        }
        canvas.getContext('2d').putImageData(new ImageData(pixels, width, height), 0, 0);
        if (!update.settled && !this.parts.status.hasAttribute('data-problem'))
            this.say(`Loading, ${(fetched.bytes / 1e6).toFixed(1)} MB`);
        this.drawOver();
        this.tell('progress', { number, samples, ...update, ...fetched, memoryBytes });
    }

    fit() {
        if (!this.info) return;
        this.orbit.fit(this.info.boundsMin, this.info.boundsMax, this.clientWidth / Math.max(this.clientHeight, 1));
        this.moved();
    }

    /// The view moves: it is drawn coarsely until it rests.
    moved() {
        this.look(true);
        clearTimeout(this.resting);
        this.resting = setTimeout(() => this.look(false), kRestMs);
    }

    look(moving) {
        if (!this.info || !this.worker || this.clientWidth === 0) return;
        const dense = Math.min(devicePixelRatio || 1, 2);
        const pixels = this.clientWidth * this.clientHeight * dense * dense;
        const scale = dense * Math.min(1, Math.sqrt(kMostPixels / pixels)) * (moving ? kMovingScale : 1);
        const width = Math.max(1, Math.round(this.clientWidth * scale)), height = Math.max(1, Math.round(this.clientHeight * scale));
        const { up, forward } = this.orbit.axes(), mode = kModes[this.mode] ?? 0, theme = kTheme[this.dataset.theme];
        this.worker.postMessage({
            type: 'look', width, height, moving, mode, number: ++this.number,
            numbers: [...this.orbit.eye(), ...forward, ...up, kFieldOfView, width, height, moving ? 1 : 0.5, mode,
                0, 0, ...theme.top, ...theme.bottom],
        });
        this.drawOver();
    }

    /// Returns what is seen at a place of the element, in CSS pixels: { position, depth, error }, or null.
    pick(x, y) {
        const { canvas } = this.parts;
        const key = `${performance.now()} ${Math.random()}`;
        return new Promise(done => {
            this.picks.set(key, done);
            this.worker.postMessage({
                type: 'pick', id: key, x: Math.min(canvas.width - 1, Math.max(0, Math.floor(x * canvas.width / this.clientWidth))),
                y: Math.min(canvas.height - 1, Math.max(0, Math.floor(y * canvas.height / this.clientHeight))),
            });
        });
    }

    async measureAt(x, y) {
        const hit = await this.pick(x, y);
        if (!hit) return;
        if (this.points.length === 2) this.points = [];
        this.points.push(hit);
        this.tell('pick', hit);
        if (this.points.length === 2) {
            const [a, b] = this.points;
            this.say(`${lengthText(length(difference(a.position, b.position)))} ± ${lengthText(a.error + b.error)}`);
        } else this.say('Click the second point');
        this.drawOver();
    }

    /// Draws what lies over the picture: measurement, annotations, scale bar.
    drawOver() {
        const width = this.clientWidth, height = this.clientHeight;
        const at = this.points.map(p => this.orbit.project(p.position, width, height));
        let svg = '';
        if (at.length === 2 && at[0] && at[1]) {
            const ends = `x1="${at[0].x}" y1="${at[0].y}" x2="${at[1].x}" y2="${at[1].y}"`;
            svg += `<line ${ends}/><line ${ends}/>`;
        }
        for (const p of at) if (p) svg += `<circle cx="${p.x}" cy="${p.y}" r="5"/>`;
        this.parts.lines.innerHTML = svg;
        this.notes.forEach(note => {
            const p = this.orbit.project(note.position, width, height);
            note.button.hidden = !p;
            if (p) note.button.style.cssText = `left:${p.x}px;top:${p.y}px`;
        });
        const unit = 2 * this.orbit.distance * Math.tan(kFieldOfView / 2) / Math.max(height, 1);
        const power = 10 ** Math.floor(Math.log10(unit * 130)), step = [5, 2, 1].find(s => s * power <= unit * 130) ?? 1;
        this.parts.scale.hidden = !this.info;
        this.parts.scale.style.width = `${step * power / unit}px`;
        this.parts.scale.firstChild.textContent = lengthText(step * power);
    }

    async readNotes() {
        const file = this.getAttribute('annotations');
        this.parts.notes.replaceChildren();
        this.notes = [];
        if (!file) return;
        try {
            const read = await (await fetch(new URL(file, document.baseURI))).json();
            if (!Array.isArray(read)) throw new Error('an array of { position, title, text } is expected');
            read.forEach((note, i) => {
                if (!Array.isArray(note.position) || note.position.length !== 3 || !note.position.every(Number.isFinite))
                    throw new Error(`annotation ${i + 1} has no position of three numbers`);
                const button = document.createElement('button');
                button.className = 'note';
                button.textContent = String(i + 1);
                button.setAttribute('aria-label', String(note.title ?? `Annotation ${i + 1}`));
                button.onclick = () => this.showNote(note);
                this.parts.notes.append(button);
                this.notes.push({ ...note, button });
            });
            this.drawOver();
        } catch (error) {
            this.say(`${file}: ${error.message}`, true);
        }
    }
    showNote(note) {
        const { card } = this.parts, isSame = !card.hidden && this.shownNote === note;
        this.shownNote = note;
        card.hidden = isSame;
        card.querySelector('h2').textContent = note.title ?? '';
        card.querySelector('p').textContent = note.text ?? '';
    }

    async copyLink() {
        history.replaceState(null, '', `#vcp=${this.orbit.toText()}`);
        try {
            await navigator.clipboard.writeText(location.href);
            this.say('The link to this view was copied');
        } catch {
            this.say('The address now leads to this view');
        }
    }

    listen() {
        const { canvas, bar, select } = this.parts, pointers = new Map();
        let travelled = 0;
        const halves = (x, y) => [(x - this.clientWidth / 2) / (this.clientHeight / 2), (y - this.clientHeight / 2) / (this.clientHeight / 2)];
        canvas.onpointerdown = event => {
            canvas.setPointerCapture(event.pointerId);
            pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
            if (pointers.size === 1) travelled = 0;
        };
        canvas.onpointermove = event => {
            const before = pointers.get(event.pointerId);
            if (!before || !this.info) return;
            const dx = event.offsetX - before.x, dy = event.offsetY - before.y;
            const others = [...pointers].filter(([id]) => id !== event.pointerId).map(([, p]) => p);
            travelled += Math.abs(dx) + Math.abs(dy);
            pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
            if (others.length > 0) {
                const span = p => Math.hypot(p.x - others[0].x, p.y - others[0].y) || 1;
                const now = { x: event.offsetX, y: event.offsetY };
                this.orbit.zoom(span(before) / span(now), ...halves((now.x + others[0].x) / 2, (now.y + others[0].y) / 2));
                this.orbit.pan(dx / 2, dy / 2, this.clientHeight);
            } else if (event.buttons & 6 || event.shiftKey) this.orbit.pan(dx, dy, this.clientHeight);
            else this.orbit.turn(dx, dy, this.clientHeight);
            this.moved();
        };
        canvas.onpointerup = canvas.onpointercancel = event => {
            pointers.delete(event.pointerId);
            if (event.type === 'pointerup' && travelled < 6 && this.dataset.tool === 'measure') this.measureAt(event.offsetX, event.offsetY);
        };
        canvas.oncontextmenu = event => event.preventDefault();
        canvas.addEventListener('wheel', event => {
            event.preventDefault();
            this.orbit.zoom(Math.exp(Math.min(Math.max(event.deltaY, -300), 300) * 0.0016), ...halves(event.offsetX, event.offsetY));
            this.moved();
        }, { passive: false });
        canvas.ondblclick = event => {
            this.orbit.zoom(0.5, ...halves(event.offsetX, event.offsetY));
            this.moved();
        };
        canvas.onkeydown = event => {
            const step = 40, way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
            if (way) this.orbit[event.shiftKey ? 'pan' : 'turn'](way[0] * step, way[1] * step, this.clientHeight);
            else if (event.key === '+' || event.key === '=') this.orbit.zoom(0.8, 0, 0);
            else if (event.key === '-') this.orbit.zoom(1.25, 0, 0);
            else if (event.key === 'f' || event.key === 'F') return this.fit();
            else if (event.key === 'm' || event.key === 'M') return this.toggleMeasuring();
            else return;
            event.preventDefault();
            this.moved();
        };
        select.onchange = () => { this.mode = select.value; };
        bar.onclick = event => {
            const what = event.target.closest('button')?.dataset.do;
            if (what === 'fit') this.fit();
            if (what === 'measure') this.toggleMeasuring();
            if (what === 'link') this.copyLink();
            if (what === 'full') document.fullscreenElement ? document.exitFullscreen() : this.requestFullscreen();
        };
        addEventListener('online', () => this.worker?.postMessage({ type: 'retry' }));
    }

    toggleMeasuring() {
        const measures = this.dataset.tool !== 'measure';
        this.dataset.tool = measures ? 'measure' : '';
        this.points = [];
        this.parts.bar.querySelector('[data-do="measure"]').setAttribute('aria-pressed', String(measures));
        this.say(measures ? 'Click two points' : '');
        this.drawOver();
    }
}

customElements.define('vcp-viewer', VcpViewer);
