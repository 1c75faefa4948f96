// A headless Firefox, spoken to by Marionette, what WebDriver stands on there. It does what browser.mjs does of Chromium.
import { spawn } from 'node:child_process';
import fs from 'node:fs';
import net from 'node:net';
import path from 'node:path';

const kKeys = { Tab: '\uE004', Enter: '\uE007', Escape: '\uE00C', ArrowLeft: '\uE012', ArrowUp: '\uE013', ArrowRight: '\uE014', ArrowDown: '\uE015' };
const kSettings = {
    'marionette.port': 0, // any that is free
    'webgl.force-enabled': true,
    'browser.shell.checkDefaultBrowser': false,
    'datareporting.policy.dataSubmissionEnabled': false,
    'security.sandbox.content.level': 0, // containers often allow none
};

export class Firefox {
    /// `profile`: a folder for what it writes, until it is closed. `settings`: of about:config, besides.
    constructor(profile, settings = {}) {
        this.profile = path.resolve(profile);
        fs.rmSync(this.profile, { recursive: true, force: true });
        fs.mkdirSync(this.profile, { recursive: true });
        fs.writeFileSync(path.join(this.profile, 'user.js'), Object.entries({ ...kSettings, ...settings })
            .map(([name, value]) => `user_pref("${name}", ${JSON.stringify(value)});\n`).join(''));
        // It refuses a home of another user and one that it can't write to.
        const home = Object.fromEntries(['HOME', 'XDG_CACHE_HOME', 'XDG_CONFIG_HOME', 'XDG_RUNTIME_DIR'].map(name => [name, this.profile]));
        this.log = path.join(this.profile, 'said');
        const said = fs.openSync(this.log, 'w');
        this.process = spawn('firefox-esr', ['--headless', '--no-remote', '--marionette', '--remote-allow-system-access', '--profile', this.profile,
            'about:blank'], { stdio: ['ignore', said, said], env: { ...process.env, ...home } });
        fs.closeSync(said);
        this.answers = new Map();
        this.sent = 0;
        this.process.on('exit', code => {
            this.hasEnded = true;
            this.fail(new Error(`Firefox ended with ${code}`));
        });
    }
    fail(error) {
        for (const { fail } of this.answers.values()) fail(error);
    }

    /// Errors: it does not start; what it said then is part of the message.
    async connect() {
        const file = path.join(this.profile, 'MarionetteActivePort'), port = () => Number(fs.existsSync(file) && fs.readFileSync(file, 'utf8'));
        for (const end = Date.now() + 300e3; !port(); await new Promise(done => setTimeout(done, 50)))
            if (this.hasEnded || Date.now() > end) throw new Error(`Firefox does not start: ${fs.readFileSync(this.log, 'utf8')}`);
        this.socket = net.connect(port(), '127.0.0.1');
        let bytes = Buffer.alloc(0);
        this.socket.on('data', piece => {
            bytes = Buffer.concat([bytes, piece]);
            for (;;) {
                // A message is its size, a colon and JSON.
                const colon = bytes.indexOf(':'), end = colon + 1 + Number(bytes.subarray(0, Math.max(colon, 0)));
                if (colon < 0 || bytes.length < end) return;
                this.hear(JSON.parse(bytes.subarray(colon + 1, end)));
                bytes = bytes.subarray(end);
            }
        });
        await this.call('WebDriver:NewSession', { pageLoadStrategy: 'none' });
        await this.call('WebDriver:SetTimeouts', { script: 300e3 });
    }
    hear(message) {
        if (!Array.isArray(message)) return; // what it is called
        const [, id, error, result] = message, { done, fail } = this.answers.get(id);
        this.answers.delete(id);
        error ? fail(new Error(error.message)) : done(result);
    }
    /// A call of the protocol.
    call(method, params = {}) {
        const id = ++this.sent, text = JSON.stringify([0, id, method, params]);
        this.socket.write(`${Buffer.byteLength(text)}:${text}`);
        return new Promise((done, fail) => this.answers.set(id, { done, fail }));
    }
    /// Runs a script with the rights of the browser itself.
    async inside(script) {
        await this.call('Marionette:SetContext', { value: 'chrome' });
        const { value } = await this.call('WebDriver:ExecuteScript', { script, args: [] });
        await this.call('Marionette:SetContext', { value: 'content' });
        return value;
    }

    /// Opens an empty page of a size. One is open at a time.
    async page(width, height) {
        if (!this.socket) await this.connect();
        const { handle } = await this.call('WebDriver:NewWindow', { type: 'tab', focus: true });
        await this.call('WebDriver:SwitchToWindow', { handle, focus: true });
        await this.call('WebDriver:SetWindowRect', { width: Math.max(width, 500) + 20, height: height + 200 });
        await this.inside(`for (const [name, size] of [['width', ${width}], ['height', ${height}]])
            for (const limit of ['min', 'max']) gBrowser.selectedBrowser.style[limit + '-' + name] = size + 'px';
            Services.console.reset();`);
        const page = new Page(this);
        await page.until(`innerWidth === ${width} && innerHeight === ${height}`);
        return page;
    }

    async close() {
        const ended = new Promise(done => this.process.once('exit', done));
        this.call('Marionette:Quit', { flags: ['eForceQuit'] }).catch(() => {});
        const stuck = setTimeout(() => this.process.kill('SIGKILL'), 60e3);
        await ended;
        clearTimeout(stuck);
        // Its other processes may still write there.
        fs.rmSync(this.profile, { recursive: true, force: true, maxRetries: 20, retryDelay: 100 });
    }
}

class Page {
    constructor(browser) {
        this.browser = browser;
    }
    go(url) {
        return this.browser.call('WebDriver:Navigate', { url });
    }
    /// What an expression of the page is, or what its promise becomes.
    async evaluate(expression) {
        const script = 'return window.eval(arguments[0])';
        return (await this.browser.call('WebDriver:ExecuteScript', { script, args: [expression] })).value;
    }
    /// Waits until an expression of the page is true. Errors: it is not after `mostMs`.
    async until(expression, mostMs = 240e3) {
        for (const end = Date.now() + mostMs; Date.now() < end;) {
            if (await this.evaluate(expression).catch(() => false)) return;
            await new Promise(done => setTimeout(done, 50));
        }
        throw new Error(`never: ${expression}`);
    }

    act(...actions) {
        return this.browser.call('WebDriver:PerformActions', { actions });
    }
    key(key) {
        const value = kKeys[key] ?? key;
        return this.act({ type: 'key', id: 'keys', actions: [{ type: 'keyDown', value }, { type: 'keyUp', value }] });
    }
    mouse(actions) {
        return this.act({ type: 'pointer', id: 'mouse', parameters: { pointerType: 'mouse' }, actions });
    }
    hover(x, y) {
        return this.mouse([{ type: 'pointerMove', x, y }]);
    }
    click(x, y) {
        return this.mouse([{ type: 'pointerMove', x: Math.round(x), y: Math.round(y) }, { type: 'pointerDown', button: 0 }, { type: 'pointerUp', button: 0 }]);
    }
    /// The wheel turns at a place, by pixels.
    wheel(x, y, deltaY) {
        return this.act({ type: 'wheel', id: 'wheel', actions: [{ type: 'scroll', x, y, deltaX: 0, deltaY }] });
    }
    /// Fingers go along: a list of places of all fingers, each an array of { x, y }.
    touch(places) {
        return this.act(...places[0].map((_, finger) => ({
            type: 'pointer', id: `finger${finger}`, parameters: { pointerType: 'touch' }, actions: places.flatMap((at, i) => {
                const move = { type: 'pointerMove', x: at[finger].x, y: at[finger].y };
                return i === 0 ? [move, { type: 'pointerDown', button: 0 }] : [move];
            }).concat({ type: 'pointerUp', button: 0 }),
        })));
    }

    /// What its console and its workers' complain of.
    complaints() {
        return this.browser.inside(`return Services.console.getMessageArray().filter(one => one instanceof Ci.nsIScriptError &&
            !(one.flags & Ci.nsIScriptError.warningFlag) && /^(http|blob)/.test(one.sourceName)).map(one => one.errorMessage)`);
    }
    async picture(file) {
        const { value } = await this.browser.call('WebDriver:TakeScreenshot', { full: false });
        fs.writeFileSync(file, Buffer.from(value, 'base64'));
    }
    async close() {
        const [handle] = await this.browser.call('WebDriver:CloseWindow');
        await this.browser.call('WebDriver:SwitchToWindow', { handle });
    }
}
