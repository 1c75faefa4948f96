// What `vcp serve` answers: site_test.mjs VCP FOLDER RANGES_JS
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import fs from 'node:fs';
import net from 'node:net';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const [vcp, folder, rangesFile] = process.argv.slice(2);
// Read as a module whatever the nearest package.json says.
fs.copyFileSync(rangesFile, 'ranges.mjs');
const { Ranges } = await import(pathToFileURL(path.resolve('ranges.mjs')));

const server = spawn(vcp, ['serve', folder, '--port', '0', '--json'], { stdio: ['ignore', 'pipe', 'inherit'] });
process.on('exit', () => server.kill('SIGKILL'));
let said = '';
for await (const piece of server.stdout) {
    said += piece;
    if (said.includes('}')) break;
}
const { address } = JSON.parse(said);
assert.match(address, /^http:\/\/127\.0\.0\.1:\d+\/$/);
const port = Number(new URL(address).port);

/// Sends bytes as they are and returns all that comes until the connection ends.
function raw(text) {
    return new Promise((done, fail) => {
        let got = '';
        const socket = net.connect(port, '127.0.0.1', () => socket.write(text));
        socket.setEncoding('latin1').on('data', piece => { got += piece; }).on('end', () => done(got)).on('error', fail);
    });
}
const get = (target, more = '') => raw(`GET ${target} HTTP/1.1\r\nHost: here\r\n${more}Connection: close\r\n\r\n`);
const statusOf = answer => Number(/^HTTP\/1\.1 (\d+) /.exec(answer)?.[1]);
const bodyOf = answer => answer.slice(answer.indexOf('\r\n\r\n') + 4);

const scan = fs.readFileSync(path.join(folder, 'scan.vcp')), size = scan.length, latin = scan.toString('latin1');

// The whole file, the page, and types that browsers insist on.
assert.equal(bodyOf(await get('/scan.vcp')), latin);
assert.match(await get('/'), /^HTTP\/1\.1 200 OK\r\nContent-Type: text\/html/);
assert.match(await get('/vcp-viewer.js?v=1'), /Content-Type: text\/javascript/);
assert.match(await get('/vcp.wasm'), /Content-Type: application\/wasm/);
// A shard's name says what is in it: browsers keep it for ever.
const shard = `${'0123456789abcdef'.repeat(2)}.vcp`;
fs.writeFileSync(path.join(folder, shard), 'x');
assert.match(await get(`/${shard}`), /\r\nCache-Control: max-age=31536000, immutable\r\n/);
assert.match(await get('/scan.vcp'), /\r\nCache-Control: no-cache\r\n/);
fs.rmSync(path.join(folder, shard));
assert.equal(bodyOf(await raw('HEAD /scan.vcp HTTP/1.1\r\nConnection: close\r\n\r\n')), '');

// Ranges, against slices of the file.
for (const [range, first, last] of [['0-0', 0, 0], ['0-99', 0, 99], ['100-', 100, size - 1], ['-64', size - 64, size - 1],
    [`${size - 1}-${size + 99}`, size - 1, size - 1], [`-${size + 5}`, 0, size - 1]]) {
    const answer = await get('/scan.vcp', `Range: bytes=${range}\r\n`);
    assert.equal(statusOf(answer), 206, range);
    assert.match(answer, new RegExp(`\r\nContent-Range: bytes ${first}-${last}/${size}\r\n`));
    assert.equal(bodyOf(answer), latin.slice(first, last + 1), range);
}
for (const range of [`${size}-`, '-0']) {
    const answer = await get('/scan.vcp', `Range: bytes=${range}\r\n`);
    assert.equal(statusOf(answer), 416, range);
    assert.match(answer, new RegExp(`Content-Range: bytes \\*/${size}`));
}
for (const range of ['bytes=5-2', 'bytes=0-1,4-5', 'lines=1-2', 'bytes=x-1', 'bytes=99999999999999999999-'])
    assert.equal(statusOf(await get('/scan.vcp', `Range: ${range}\r\n`)), 200, range);

// Nothing outside of the folder, however it is spelled or linked.
for (const target of ['/../mine.html', '/%2e%2e/mine.html', '/..%2fmine.html', '/./../mine.html', '/outside.html',
    '/../site_twin/secret.txt', '/nothing', '/scan.vcp/', '//etc/passwd']) {
    const answer = await get(target);
    assert.equal(statusOf(answer), 404, target);
    assert.ok(!answer.includes('secret') && !answer.includes('mine -->') && !answer.includes('root:'), target);
}

// What is no request, or none that is answered.
assert.equal(statusOf(await raw('POST / HTTP/1.1\r\nContent-Length: 2\r\n\r\nhi')), 405);
for (const text of ['hello\r\n\r\n', 'GET /\r\n\r\n', 'GET x HTTP/1.1\r\n\r\n', 'GET /%0 HTTP/1.1\r\n\r\n',
    'GET /%00 HTTP/1.1\r\n\r\n', 'GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n', '\r\n\r\n',
    'GET / HTTP/1.1\r\nno colon\r\n\r\n'])
    assert.equal(statusOf(await raw(text)), 400, text);
assert.equal(statusOf(await raw(`GET /${'a'.repeat(40000)}`)), 400);
assert.equal(statusOf(await raw(`GET / HTTP/1.1\r\n${'X: y\r\n'.repeat(5000)}`)), 400);

// The viewer's own reader, over connections that stay; several at once, and more than are served at a time.
const ranges = new Ranges(`${address}scan.vcp`);
await ranges.read(0, 100);
assert.equal(ranges.size, size);
await Promise.all(Array.from({ length: 200 }, async (_, i) => {
    const at = i * 37 % (size - 500);
    assert.deepEqual(Buffer.from(await ranges.read(at, 500)), scan.subarray(at, at + 500));
}));

// It ends when it is asked to, with a connection open: one that was answered, since the system resets those that a server
// has not taken yet when it ends.
const idle = net.connect(port, '127.0.0.1');
idle.write('HEAD / HTTP/1.1\r\nHost: here\r\n\r\n');
await new Promise(done => idle.once('data', done));
const ended = new Promise(done => server.once('exit', code => done(code)));
server.kill('SIGINT');
assert.equal(await ended, 0);
idle.destroy();
console.log('site_test: all checks passed');
process.exit(0);
