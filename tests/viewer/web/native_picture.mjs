// What `vcp render` saw, against what the viewer for browsers sees.
import fs from 'node:fs';
import zlib from 'node:zlib';

/// Returns distances along the unit rays, row by row from the upper left; infinite where nothing is hit.
export function readDepth(file, width, height) {
    const bytes = fs.readFileSync(file), floats = bytes.subarray(bytes.length - 4 * width * height);
    // A PFM begins with its lowest row.
    return Float32Array.from({ length: width * height }, (_, i) =>
        floats.readFloatLE(4 * ((height - 1 - Math.floor(i / width)) * width + i % width)));
}

/// Returns how many pixels differ beyond `tolerance`, and how many of `ours` are hits.
export function compareDepth(ours, theirs, tolerance) {
    let differ = 0, hits = 0;
    theirs.forEach((depth, i) => {
        const isHit = Number.isFinite(ours[i]);
        hits += isHit ? 1 : 0;
        if (isHit !== Number.isFinite(depth) || (isHit && !(Math.abs(ours[i] - depth) <= tolerance))) ++differ;
    });
    return { differ, hits };
}

/// Returns the pixels of a PNG of 8 bits a channel, row by row, RGBA; its rows are not interlaced.
export function readPicture(file) {
    const bytes = fs.readFileSync(file), parts = [];
    const [width, height] = [bytes.readUInt32BE(16), bytes.readUInt32BE(20)], channels = { 2: 3, 6: 4 }[bytes[25]];
    for (let at = 8; at < bytes.length; at += 12 + bytes.readUInt32BE(at))
        if (bytes.toString('latin1', at + 4, at + 8) === 'IDAT') parts.push(bytes.subarray(at + 8, at + 8 + bytes.readUInt32BE(at)));
    const rows = zlib.inflateSync(Buffer.concat(parts)), stride = width * channels, pixels = new Uint8ClampedArray(4 * width * height).fill(255);
    let before = new Uint8Array(stride);
    for (let y = 0; y < height; ++y) {
        const row = rows.subarray(y * (stride + 1) + 1, (y + 1) * (stride + 1)), filter = rows[y * (stride + 1)];
        for (let i = 0; i < stride; ++i) {
            const left = i < channels ? 0 : row[i - channels], above = before[i], corner = i < channels ? 0 : before[i - channels];
            row[i] += [0, left, above, left + above >> 1, nearestTo(left + above - corner, left, above, corner)][filter];
        }
        for (let x = 0; x < width; ++x) pixels.set(row.subarray(x * channels, (x + 1) * channels), 4 * (y * width + x));
        before = row;
    }
    return pixels;
}
/// Paeth's choice.
function nearestTo(guess, left, above, corner) {
    const [a, b, c] = [left, above, corner].map(value => Math.abs(guess - value));
    return a <= b && a <= c ? left : b <= c ? above : corner;
}

/// Returns how many pixels have a channel that differs by more than `tolerance`, of those that `counts(i)`; and the mean
/// and the largest difference of all channels.
export function compareColours(ours, theirs, tolerance, counts = () => true) {
    let differ = 0, counted = 0, sum = 0, most = 0;
    for (let i = 0; i < ours.length / 4; ++i) {
        if (!counts(i)) continue;
        ++counted;
        const apart = [0, 1, 2].map(channel => Math.abs(ours[4 * i + channel] - theirs[4 * i + channel]));
        differ += Math.max(...apart) > tolerance ? 1 : 0;
        most = Math.max(most, ...apart);
        sum += apart[0] + apart[1] + apart[2];
    }
    return { differ, counted, mean: sum / counted / 3, most };
}
