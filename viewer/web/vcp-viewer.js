// <vcp-viewer src="scan.vcp">: a scan in a page, streamed and drawn by a worker.
import { Light, Orbit, kFieldOfView, difference, length, movingScale, sectionOf, upOf } from './camera.js';
import { kMarkup, kStyle } from './markup.js';

const kModes = { lit: 0, clay: 1, unlit: 2, normals: 3, level: 7, error: 8, wireframe: 9 };
const kEnvironments = ['studio', 'overcast', 'clear'];
const kMovingScale = 0.4; // of the resolution, while the view moves for the first time
const kOcclusionRays = 3; // a pixel and sample
const kRestMs = 160; // without a movement: the view is at rest
const kSaidMs = 4000; // a line that answers a button stands as long
const kTapMs = 300, kTapPixels = 24; // two taps so near each other are one double tap
const kMostPixels = 1.6e6, kMostSide = 16384; // of pictures
const kColourError = 6; // ΔE that may be seen, where nothing else is asked for
const kPhoneBudget = 64 << 20, kBudget = 192 << 20, kMostBudget = 4096; // of decoded pages, in all workers
const kWorkerBudget = 32 << 20, kLeastShare = 1 << 20; // of the budget for each worker more; of what it holds of pages
const kMostWorkers = 8;

const kTheme = {
    dark: { top: [0.10, 0.12, 0.15], bottom: [0.25, 0.27, 0.30] },
    light: { top: [0.78, 0.81, 0.85], bottom: [0.92, 0.93, 0.95] },
};

/// Returns how the budget is shared: the pages of the first worker, and what each of the others may hold of them. Others
/// have a third of it together. `asked`: workers, NaN where that is left to the browser.
function sharedBudget(budgetBytes, asked) {
    const others = Number.isInteger(asked) && asked > 0
        ? Math.min(asked - 1, Math.floor(budgetBytes / 3 / kLeastShare))
        : Math.min((navigator.hardwareConcurrency || 1) - 1, Math.floor(budgetBytes / kWorkerBudget), kMostWorkers - 1);
    if (others === 0) return { pageBytes: budgetBytes, others, shareBytes: 0 };
    const shareBytes = Math.floor(budgetBytes / 3 / others);
    return { pageBytes: budgetBytes - others * shareBytes, others, shareBytes };
}

/// The number that an attribute says, at least 0; `usual` where it says none.
function numberOf(text, usual) {
    const number = parseFloat(text);
    return number >= 0 ? number : usual;
}

/// A length for people: three digits.
function lengthText(x) {
    return x === 0 ? '0' : Number(x.toPrecision(3)).toString();
}

/// A length and by how much it may be off, which says how many digits of the length are worth reading.
function measureText(x, error) {
    const decimals = Math.min(Math.max(1 - Math.floor(Math.log10(error)), 0), 12);
    return `${x.toFixed(decimals)} ± ${error.toFixed(decimals)}`;
}

export class VcpViewer extends HTMLElement {
    static observedAttributes = ['src', 'mode', 'annotations', 'theme', 'light', 'environment', 'shadows', 'occlusion', 'plain',
        'section', 'up', 'colour-error'];

    constructor() {
        super();
        const root = this.attachShadow({ mode: 'open' });
        root.innerHTML = `<style>${kStyle}</style>${kMarkup}`;
        const find = what => root.querySelector(what);
        this.parts = {
            canvas: find('canvas'), lines: find('svg'), notes: find('.notes'), status: find('.status'), scale: find('.scale'),
            bar: find('.bar'), select: find('.bar select'), card: find('.card'), panel: find('.panel'),
        };
        this.orbit = new Orbit();
        this.light = new Light();
        this.movingScale = kMovingScale;
        this.info = null;
        this.number = 0;
        this.points = []; // of the measurement
        this.notes = [];
        this.notesSeen = null; // the view that they are placed for
        this.problems = {}; // by what has one: page, scan, notes
        this.said = this.loading = '';
        this.picks = new Map();
        this.worker = null;
        this.casters = []; // the workers beside it
        find('[data-do="full"]').hidden = !document.fullscreenEnabled;
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
        this.onHidden = () => this.worker?.postMessage({ type: 'hide', hidden: document.hidden });
        document.addEventListener('visibilitychange', this.onHidden);
        // What could not even be opened is begun anew.
        this.onOnline = () => (this.info || !this.problems.scan ? this.worker?.postMessage({ type: 'retry' }) : this.open());
        addEventListener('online', this.onOnline);
        this.chooseTheme();
        this.light.fromText(this.getAttribute('light') ?? '');
        this.showControls();
        if (this.src) this.open();
    }
    disconnectedCallback() {
        this.dark.removeEventListener('change', this.onScheme);
        document.removeEventListener('visibilitychange', this.onHidden);
        removeEventListener('online', this.onOnline);
        this.resizing.disconnect();
        this.endWorkers();
    }
    attributeChangedCallback(name, before, now) {
        if (!this.isConnected || before === now) return;
        if (name === 'src') this.open();
        if (name === 'annotations') this.readNotes();
        if (name === 'theme') this.chooseTheme();
        if (name === 'light') this.light.fromText(now ?? '');
        if (name === 'up') return this.fit();
        this.showControls();
        if (['light', 'section'].includes(name)) this.moved();
        else this.look(false);
    }

    /// Of what lights the scan: 0, or 1 + the number of surroundings.
    get environment() { return 1 + kEnvironments.indexOf(this.getAttribute('environment')); }

    /// Sets the controls to what is shown.
    showControls() {
        this.parts.select.value = this.mode;
        const control = name => this.parts.panel.querySelector(`[data-set="${name}"]`);
        control('side').value = this.light.side;
        control('above').value = this.light.above;
        const isAround = this.environment > 0;
        control('environment').value = isAround ? this.getAttribute('environment') : '';
        for (const name of ['side', 'above', 'shadows']) control(name).disabled = isAround;
        control('shadows').checked = this.hasAttribute('shadows');
        control('occlusion').checked = this.hasAttribute('occlusion');
        control('plain').checked = this.hasAttribute('plain');
        const [axis, place] = (this.getAttribute('section') ?? ',0.5').split(',');
        control('axis').value = axis;
        control('place').value = 100 * Number(place);
        control('place').disabled = axis === '';
    }
    /// Does what a control of the panel was set to.
    changed(control) {
        const { panel } = this.parts, value = name => panel.querySelector(`[data-set="${name}"]`).value;
        const what = control.dataset.set;
        if (['shadows', 'occlusion', 'plain'].includes(what)) this.toggleAttribute(what, control.checked);
        else if (what === 'environment' && control.value === '') this.removeAttribute(what);
        else if (what === 'environment') this.setAttribute(what, control.value);
        else if (what === 'side' || what === 'above') this.setAttribute('light', `${value('side')},${value('above')}`);
        else if (value('axis') === '') this.removeAttribute('section');
        else this.setAttribute('section', `${value('axis')},${value('place') / 100}`);
    }

    chooseTheme() {
        const theme = this.getAttribute('theme') ?? (this.dark?.matches ? 'dark' : 'light');
        this.dataset.theme = theme === 'dark' ? 'dark' : 'light';
    }

    tell(type, detail) {
        this.dispatchEvent(new CustomEvent(type, { detail, bubbles: true }));
    }
    /// Shows what matters most: a problem, what a button did, what to do next, how far loading is.
    showStatus() {
        const { status } = this.parts, problem = this.problems.page ?? this.problems.scan ?? this.problems.notes;
        status.textContent = problem ?? (this.said || this.measured() || this.loading);
        status.toggleAttribute('data-problem', problem !== undefined);
    }
    /// A problem stands until what has it is right again.
    fail(what, message) {
        this.problems[what] = message;
        this.showStatus();
        this.tell('error', { message });
    }
    say(text) {
        this.said = text;
        this.showStatus();
        clearTimeout(this.saying);
        this.saying = setTimeout(() => {
            this.said = '';
            this.showStatus();
        }, kSaidMs);
    }

    endWorkers() {
        for (const worker of [this.worker, ...this.casters]) worker?.terminate();
        for (const done of this.picks.values()) done(null);
        this.picks.clear();
        this.worker = null;
        this.casters = [];
    }
    /// Starts the workers beside the first one, which speaks to each through a channel. `start`: what they begin with; not
    /// every browser lets compiled modules through channels.
    startCasters(start) {
        const { others, shareBytes } = this.shared;
        for (let number = 0; number < others; ++number) {
            const caster = new Worker(new URL('./caster.js', import.meta.url), { type: 'module' });
            const { port1, port2 } = new MessageChannel(), first = this.worker;
            caster.onerror = event => {
                event.preventDefault(); // the first worker does without it
                first.postMessage({ type: 'lost', number });
            };
            first.postMessage({ type: 'caster', number, port: port2, shareBytes }, [port2]);
            caster.postMessage({ port: port1, ...start }, [port1]);
            this.casters.push(caster);
        }
    }

    open() {
        this.endWorkers();
        this.info = null;
        this.points = [];
        this.problems = {};
        this.loading = this.src ? 'Opening…' : '';
        this.parts.canvas.width = this.parts.canvas.width; // empties it
        this.drawOver();
        this.showStatus();
        if (!this.src) return;
        this.worker = new Worker(new URL('./worker.js', import.meta.url), { type: 'module' });
        this.worker.onmessage = ({ data }) => this.hear(data);
        this.worker.onerror = event => this.fail('scan', event.message || 'the viewer could not be loaded');
        const isPhone = matchMedia('(pointer: coarse)').matches;
        const budget = Math.min(numberOf(this.getAttribute('budget'), 0), kMostBudget) * 2 ** 20 || (isPhone ? kPhoneBudget : kBudget);
        this.shared = sharedBudget(budget, Number(this.getAttribute('workers') ?? NaN));
        this.worker.postMessage({
            type: 'open', url: new URL(this.src, document.baseURI).href, wasm: new URL('./vcp.wasm', import.meta.url).href,
            budgetBytes: this.shared.pageBytes, draw: this.getAttribute('draw'),
        });
        this.readNotes();
    }

    hear(message) {
        if (message.type === 'opened') {
            this.info = message.info;
            if (!this.info.hasColour) this.parts.select.querySelector('[value="unlit"]')?.remove();
            this.startCasters(message.start);
            this.fit();
            const link = /(?:^#|&)vcp=([^&]+)/.exec(location.hash);
            if (link && this.orbit.fromText(link[1].replace(/%2c/gi, ','))) this.look(false);
            this.tell('load', { info: this.info });
        } else if (message.type === 'picture') this.show(message);
        else if (message.type === 'settled') {
            if (message.number !== this.number) return;
            this.loading = '';
            delete this.problems.scan;
            this.showStatus();
            this.tell('settled', message.update);
        } else if (message.type === 'picked') {
            this.picks.get(message.id)?.(message.hit);
            this.picks.delete(message.id);
        } else if (message.type === 'problem') this.fail('page', message.message);
        else if (message.type === 'error') this.fail('scan', message.message);
    }

    show({ width, height, pixels, bitmap, number, samples, update, fetched, memoryBytes, gpuBytes, workers, drawnBy, moving, ms }) {
        // The other one takes as long as it did at first, for all that is known.
        if (this.drawnBy !== drawnBy) this.movingScale = kMovingScale;
        this.drawnBy = drawnBy;
        if (moving) this.movingScale = movingScale(this.movingScale, ms);
        const { canvas } = this.parts;
        if (canvas.width !== width || canvas.height !== height) {
            canvas.width = width;
            canvas.height = height;
        }
        const context = canvas.getContext('2d');
        if (bitmap) {
            context.drawImage(bitmap, 0, 0);
            bitmap.close();
        } else context.putImageData(new ImageData(pixels, width, height), 0, 0);
        this.loading = update.settled ? '' : `Loading, ${(fetched.bytes / 1e6).toFixed(1)} MB`;
        this.showStatus();
        this.drawOver();
        this.tell('progress', { number, samples, ...update, ...fetched, memoryBytes, gpuBytes, workers, drawnBy, ms, width, height });
    }

    fit() {
        if (!this.info) return;
        const { boundsMin, boundsMax } = this.info, asked = this.getAttribute('up');
        this.orbit.up = ['y', 'z'].includes(asked) ? asked : upOf(boundsMin, boundsMax);
        this.orbit.fit(boundsMin, boundsMax, this.clientWidth / Math.max(this.clientHeight, 1));
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
        const pixels = this.clientWidth * this.clientHeight * dense * dense, side = Math.max(this.clientWidth, this.clientHeight) * dense;
        const scale = dense * Math.min(1, Math.sqrt(kMostPixels / pixels), kMostSide / side) * (moving ? this.movingScale : 1);
        const width = Math.max(1, Math.round(this.clientWidth * scale)), height = Math.max(1, Math.round(this.clientHeight * scale));
        const colourError = numberOf(this.getAttribute('colour-error'), kColourError);
        const { up, forward } = this.orbit.axes(), mode = Object.hasOwn(kModes, this.mode) ? kModes[this.mode] : 0, theme = kTheme[this.dataset.theme];
        this.worker.postMessage({
            type: 'look', width, height, moving, mode, number: ++this.number,
            eye: this.orbit.eye(), forward, up, fov: kFieldOfView, errorPixels: moving ? 1 : 0.5, colourError,
            shadows: this.hasAttribute('shadows'), plain: this.hasAttribute('plain'),
            occlusionRays: this.hasAttribute('occlusion') && !moving ? kOcclusionRays : 0,
            top: theme.top, bottom: theme.bottom, light: this.light.direction(),
            environment: this.environment,
            upright: this.orbit.up === 'z' ? [0, 0, 1] : [0, 1, 0],
            section: sectionOf(this.getAttribute('section'), this.info.boundsMin, this.info.boundsMax),
        });
        this.drawOver();
    }

    /// Returns what is seen at a place of the element, in CSS pixels: { position, depth, error }, or null.
    pick(x, y) {
        if (!this.worker) return Promise.resolve(null);
        const key = `${performance.now()} ${Math.random()}`;
        return new Promise(done => {
            this.picks.set(key, done);
            this.worker.postMessage({ type: 'pick', id: key, x: x / this.clientWidth, y: y / this.clientHeight });
        });
    }

    /// What measuring says: what to do next, or the distance and by how much it may be off.
    measured() {
        if (this.dataset.tool !== 'measure') return '';
        const [a, b] = this.points;
        if (!b) return a ? 'Click the second point' : 'Click two points';
        return measureText(length(difference(a.position, b.position)), a.error + b.error);
    }
    async measureAt(x, y) {
        const hit = await this.pick(x, y);
        if (!hit) return;
        if (this.points.length === 2) this.points = [];
        this.points.push(hit);
        this.tell('pick', hit);
        this.showStatus();
        this.drawOver();
    }

    /// Draws what lies over the picture: measurement, annotations, scale bar.
    drawOver() {
        const width = this.clientWidth, height = this.clientHeight;
        const at = this.points.map(p => this.orbit.project(p.position, width, height));
        let svg = '';
        // Where Enter measures.
        if (this.dataset.tool === 'measure' && this.parts.canvas.matches(':focus-visible'))
            svg += `<path d="M${width / 2 - 9} ${height / 2}h18m-9-9v18"/>`;
        if (at.length === 2 && at[0] && at[1]) {
            const ends = `x1="${at[0].x}" y1="${at[0].y}" x2="${at[1].x}" y2="${at[1].y}"`;
            svg += `<line ${ends}/><line ${ends}/>`;
        }
        // The circles lie over the line, and the distance over both.
        for (const p of at) if (p) svg += `<circle cx="${p.x}" cy="${p.y}" r="5"/>`;
        if (at.length === 2 && at[0] && at[1])
            svg += `<text x="${(at[0].x + at[1].x) / 2}" y="${(at[0].y + at[1].y) / 2 - 10}">${this.measured()}</text>`;
        this.parts.lines.innerHTML = svg;
        this.placeNotes(width, height);
        const unit = 2 * this.orbit.distance * Math.tan(kFieldOfView / 2) / Math.max(height, 1);
        const power = 10 ** Math.floor(Math.log10(unit * 130)), step = [5, 2, 1].find(s => s * power <= unit * 130) ?? 1;
        this.parts.scale.hidden = !this.info;
        this.parts.scale.style.width = `${step * power / unit}px`;
        this.parts.scale.firstChild.textContent = lengthText(step * power);
    }

    /// Of thousands that is work, so it is done where the view is another one.
    placeNotes(width, height) {
        const seen = `${this.camera} ${width} ${height}`;
        if (seen === this.notesSeen) return;
        this.notesSeen = seen;
        for (const { position, button } of this.notes) {
            const p = this.orbit.project(position, width, height);
            button.hidden = !(p && p.x >= 0 && p.x <= width && p.y >= 0 && p.y <= height);
            if (!button.hidden) button.style.translate = `${p.x}px ${p.y}px`;
        }
    }

    async readNotes() {
        const file = this.getAttribute('annotations'), reading = this.reading = {};
        this.parts.notes.replaceChildren();
        this.parts.card.hidden = true;
        this.notes = [];
        delete this.problems.notes;
        this.showStatus();
        if (!file) return;
        try {
            const answer = await fetch(new URL(file, document.baseURI));
            if (!answer.ok) throw new Error(`the server answers ${answer.status}`);
            const read = await answer.json();
            if (reading !== this.reading) return; // another file is being read
            if (!Array.isArray(read)) throw new Error('an array of { position, title, text } is expected');
            this.notes = read.map((note, i) => {
                if (!Array.isArray(note?.position) || note.position.length !== 3 || !note.position.every(Number.isFinite))
                    throw new Error(`annotation ${i + 1} has no position of three numbers`);
                const button = document.createElement('button');
                button.className = 'note';
                button.textContent = String(i + 1);
                button.setAttribute('aria-label', String(note.title ?? `Annotation ${i + 1}`));
                button.onclick = () => this.showNote(note);
                return { position: note.position, button };
            });
            this.parts.notes.append(...this.notes.map(note => note.button));
            this.notesSeen = null;
            this.drawOver();
        } catch (error) {
            if (reading === this.reading) this.fail('notes', `${file}: ${error.message}`);
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
        let travelled = 0, tapped = { time: -kTapMs, x: 0, y: 0 };
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
            } else if (event.ctrlKey && this.environment === 0) {
                this.light.turn(dx, dy, this.clientHeight);
                this.setAttribute('light', this.light.toText());
            } else if (event.buttons & 6 || event.shiftKey) this.orbit.pan(dx, dy, this.clientHeight);
            else this.orbit.turn(dx, dy, this.clientHeight);
            this.moved();
        };
        canvas.onpointerup = canvas.onpointercancel = event => {
            pointers.delete(event.pointerId);
            if (event.type !== 'pointerup' || event.button !== 0 || travelled >= 6) return;
            const now = { time: event.timeStamp, x: event.offsetX, y: event.offsetY };
            if (this.dataset.tool === 'measure') this.measureAt(now.x, now.y);
            else if (now.time - tapped.time < kTapMs && Math.hypot(now.x - tapped.x, now.y - tapped.y) < kTapPixels) {
                this.orbit.zoom(0.5, ...halves(now.x, now.y));
                this.moved();
                now.time = -kTapMs; // a third tap begins anew
            }
            tapped = now;
        };
        // What a browser's GPU process had is gone with it.
        canvas.addEventListener('contextrestored', () => this.look(false));
        canvas.oncontextmenu = event => event.preventDefault();
        canvas.addEventListener('wheel', event => {
            event.preventDefault();
            this.orbit.zoom(Math.exp(Math.min(Math.max(event.deltaY, -300), 300) * 0.0016), ...halves(event.offsetX, event.offsetY));
            this.moved();
        }, { passive: false });
        canvas.onkeydown = event => {
            const step = 40, way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
            if (way) this.orbit[event.shiftKey ? 'pan' : 'turn'](way[0] * step, way[1] * step, this.clientHeight);
            else if (event.key === '+' || event.key === '=') this.orbit.zoom(0.8, 0, 0);
            else if (event.key === '-') this.orbit.zoom(1.25, 0, 0);
            else if (event.key === 'f' || event.key === 'F') return this.fit();
            else if (event.key === 'm' || event.key === 'M') return this.toggleMeasuring();
            else if (event.key === 'Enter' && this.dataset.tool === 'measure') return void this.measureAt(this.clientWidth / 2, this.clientHeight / 2);
            else return;
            event.preventDefault();
            this.moved();
        };
        select.onchange = () => { this.mode = select.value; };
        bar.onclick = event => {
            const what = event.target.closest('button')?.dataset.do;
            if (what === 'fit') this.fit();
            if (what === 'measure') this.toggleMeasuring();
            if (what === 'more') this.togglePanel();
            if (what === 'link') this.copyLink();
            if (what === 'full') (document.fullscreenElement ? document.exitFullscreen() : this.requestFullscreen()).catch(() => {});
        };
        this.parts.panel.oninput = event => this.changed(event.target);
        canvas.onfocus = canvas.onblur = () => this.drawOver();
        this.shadowRoot.addEventListener('keydown', event => {
            if (event.key === 'Escape') this.closeAll();
        });
    }

    /// Closes what lies over the picture.
    closeAll() {
        if (!this.parts.panel.hidden) this.togglePanel();
        if (!this.parts.card.hidden) this.showNote(this.shownNote);
        if (this.dataset.tool === 'measure') this.toggleMeasuring();
    }

    togglePanel() {
        const { panel, bar } = this.parts, button = bar.querySelector('[data-do="more"]');
        panel.hidden = !panel.hidden;
        button.setAttribute('aria-pressed', String(!panel.hidden));
        button.setAttribute('aria-expanded', String(!panel.hidden));
    }

    toggleMeasuring() {
        const measures = this.dataset.tool !== 'measure';
        this.dataset.tool = measures ? 'measure' : '';
        this.points = [];
        this.parts.bar.querySelector('[data-do="measure"]').setAttribute('aria-pressed', String(measures));
        this.showStatus();
        this.drawOver();
    }
}

customElements.define('vcp-viewer', VcpViewer);
