// A headless Chromium, spoken to by its debugging protocol over a pipe.
import { spawn } from 'node:child_process';
import fs from 'node:fs';

export class Browser {
    /// `profile`: a folder for what it writes, until it is closed. `gpu`: what stands in for a GPU, SwiftShader.
    constructor(profile, { gpu = false } = {}) {
        this.profile = profile;
        this.process = spawn('chromium', ['--headless=new', '--no-sandbox',
            ...(gpu ? ['--use-angle=swiftshader', '--enable-unsafe-swiftshader'] : ['--disable-gpu']), '--disable-dev-shm-usage',
            '--remote-debugging-pipe', '--no-first-run', `--user-data-dir=${profile}`, 'about:blank'],
            { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
        this.process.on('exit', code => { if (!this.closed) this.fail(new Error(`chromium ended with ${code}`)); });
        [, , , this.to, this.from] = this.process.stdio;
        this.answers = new Map();
        this.hears = new Map(); // by session: what hears its events
        this.sent = 0;
        let rest = '';
        this.from.setEncoding('utf8').on('data', piece => {
            const messages = (rest + piece).split('\0');
            rest = messages.pop();
            for (const message of messages) this.hear(JSON.parse(message));
        });
    }

    hear({ id, result, error, method, params, sessionId }) {
        if (id === undefined) return this.hears.get(sessionId)?.(method, params);
        const { done, fail } = this.answers.get(id);
        this.answers.delete(id);
        error ? fail(new Error(error.message)) : done(result);
    }
    fail(error) {
        for (const { fail } of this.answers.values()) fail(error);
    }

    /// A call of the protocol.
    call(method, params = {}, sessionId = undefined) {
        const id = ++this.sent;
        this.to.write(JSON.stringify({ id, method, params, sessionId }) + '\0');
        return new Promise((done, fail) => this.answers.set(id, { done, fail }));
    }

    /// Opens an empty page of a size; `touch`: one of a phone. Its `errors`: what its console and its workers' complain of.
    async page(width, height, touch) {
        const { targetId } = await this.call('Target.createTarget', { url: 'about:blank' });
        const { sessionId } = await this.call('Target.attachToTarget', { targetId, flatten: true });
        const page = new Page(this, targetId, sessionId);
        await page.listen(sessionId);
        await page.call('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: 1, mobile: touch });
        await page.call('Emulation.setTouchEmulationEnabled', { enabled: touch, maxTouchPoints: touch ? 2 : 1 });
        await page.call('Page.enable');
        return page;
    }

    async close() {
        this.closed = true;
        const ended = new Promise(done => this.process.once('exit', done));
        await this.call('Browser.close');
        await ended;
        // Its other processes may still write there.
        fs.rmSync(this.profile, { recursive: true, force: true, maxRetries: 20, retryDelay: 100 });
    }
}

class Page {
    constructor(browser, targetId, sessionId) {
        Object.assign(this, { browser, targetId, sessionId, errors: [], workers: [] });
    }
    call(method, params = {}) {
        return this.browser.call(method, params, this.sessionId);
    }

    /// Hears what a session of this page says: the page's own, or that of one of its workers.
    async listen(session) {
        this.browser.hears.set(session, (method, params) => {
            if (method === 'Target.attachedToTarget') {
                this.workers.push(params.sessionId);
                this.listen(params.sessionId);
            }
            const text = ({ exception, text }) => String(exception?.description ?? exception?.value ?? text);
            if (method === 'Runtime.exceptionThrown') this.errors.push(text(params.exceptionDetails));
            if (method === 'Runtime.consoleAPICalled' && params.type === 'error') this.errors.push(String(params.args[0]?.value));
            if (method === 'Log.entryAdded' && params.entry.level === 'error') this.errors.push(params.entry.text);
        });
        const ask = (method, params) => this.browser.call(method, params, session).catch(() => {}); // workers end
        await Promise.all([ask('Runtime.enable'), ask('Log.enable'),
            ask('Target.setAutoAttach', { autoAttach: true, waitForDebuggerOnStart: false, flatten: true })]);
    }

    go(url) {
        return this.call('Page.navigate', { url });
    }
    /// What its console and its workers' complain of.
    complaints() {
        return this.errors;
    }
    /// What an expression of the page is, or what its promise becomes.
    async evaluate(expression) {
        const answer = await this.call('Runtime.evaluate', { expression, awaitPromise: true, returnByValue: true });
        if (answer.exceptionDetails) throw new Error(answer.exceptionDetails.exception?.description ?? expression);
        return answer.result.value;
    }
    /// Waits until an expression of the page is true. Errors: it is not after `mostMs`.
    async until(expression, mostMs = 240e3) {
        for (const end = Date.now() + mostMs; Date.now() < end;) {
            if (await this.evaluate(expression)) return;
            await new Promise(done => setTimeout(done, 50));
        }
        throw new Error(`never: ${expression}`);
    }

    async key(key) {
        for (const type of ['keyDown', 'keyUp']) await this.call('Input.dispatchKeyEvent', { type, key });
    }
    async click(x, y) {
        for (const type of ['mousePressed', 'mouseReleased'])
            await this.call('Input.dispatchMouseEvent', { type, x, y, button: 'left', clickCount: 1 });
    }
    hover(x, y) {
        return this.call('Input.dispatchMouseEvent', { type: 'mouseMoved', x, y });
    }
    /// The wheel turns at a place, by pixels.
    wheel(x, y, deltaY) {
        return this.call('Input.dispatchMouseEvent', { type: 'mouseWheel', x, y, deltaX: 0, deltaY });
    }
    /// Fingers go along: a list of places of all fingers, each an array of { x, y }.
    async touch(places) {
        const at = (type, touchPoints) => this.call('Input.dispatchTouchEvent', { type, touchPoints });
        await at('touchStart', places[0]);
        for (const place of places.slice(1)) await at('touchMove', place);
        await at('touchEnd', []);
    }

    /// Ends all contexts of WebGL of its workers, as a browser may at any time; returns how many they were.
    async loseContexts() {
        let lost = 0;
        for (const session of this.workers) {
            const call = (method, params) => this.browser.call(method, params, session);
            const { result: prototype } = await call('Runtime.evaluate', { expression: 'WebGL2RenderingContext.prototype' });
            const { objects } = await call('Runtime.queryObjects', { prototypeObjectId: prototype.objectId });
            const { result } = await call('Runtime.callFunctionOn', {
                objectId: objects.objectId, returnByValue: true,
                functionDeclaration: `function() { for (const gl of this) gl.getExtension('WEBGL_lose_context').loseContext(); return this.length; }`,
            });
            lost += result.value;
        }
        return lost;
    }

    async picture(file) {
        const { data } = await this.call('Page.captureScreenshot', { format: 'png' });
        fs.writeFileSync(file, Buffer.from(data, 'base64'));
    }
    close() {
        return this.browser.call('Target.closeTarget', { targetId: this.targetId });
    }
}
