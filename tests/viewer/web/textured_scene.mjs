// Writes a mesh with images: textured_scene.mjs FOLDER EDGE WIDTH [channels]
// A wavy floor of EDGE x EDGE squares, which shows tiles.png, WIDTH texels wide, 1.5 times along x and once along z, and
// a wall of two triangles behind it, which shows wall.png, whose edges are no powers of two. With channels, the floor has
// normals and is smooth, and the wall shines.
import fs from 'node:fs';
import path from 'node:path';
import zlib from 'node:zlib';

/// Returns the CRC-32 of a PNG's chunk.
function crc(bytes) {
    let all = 0xffffffff;
    for (const byte of bytes) {
        all ^= byte;
        for (let bit = 0; bit < 8; ++bit) all = (all >>> 1) ^ (all & 1 ? 0xedb88320 : 0);
    }
    return (all ^ 0xffffffff) >>> 0;
}

function chunk(type, content) {
    const bytes = Buffer.alloc(12 + content.length);
    bytes.writeUInt32BE(content.length);
    bytes.write(type, 4, 'latin1');
    content.copy(bytes, 8);
    bytes.writeUInt32BE(crc(bytes.subarray(4, 8 + content.length)), 8 + content.length);
    return bytes;
}

/// `colourAt(x, y)`: red, green and blue.
function png(width, height, colourAt) {
    const header = Buffer.alloc(13), rows = Buffer.alloc(height * (1 + 3 * width));
    header.writeUInt32BE(width);
    header.writeUInt32BE(height, 4);
    header.set([8, 2], 8);
    for (let y = 0; y < height; ++y)
        for (let x = 0; x < width; ++x) rows.set(colourAt(x, y), y * (1 + 3 * width) + 1 + 3 * x);
    return Buffer.concat([Buffer.from('89504e470d0a1a0a', 'hex'), chunk('IHDR', header), chunk('IDAT', zlib.deflateSync(rows)),
        chunk('IEND', Buffer.alloc(0))]);
}

const wave = (x, scale) => Math.round(127.5 + 127.5 * Math.sin(x / scale));
/// Returns 0 to 15: as the noise of a photograph, so that tiles are smaller as JPEGs.
const noise = (x, y) => Math.imul(Math.imul(x + 1031 * y, 0x9e3779b1) ^ 0x5bd1e995, 0x85ebca6b) >>> 28;
const tiles = (x, y) => {
    const more = noise(x, y), green = (x >> 5) + (y >> 5) & 1 ? 210 : 40;
    return [wave(x, 9) * 0.9 + more, green + more, wave(x + 2 * y, 23) * 0.9 + more];
};
const wall = (x, y) => [(x >> 3) + (y >> 3) & 1 ? 250 : 20, wave(y, 5), wave(x * y, 900)];

/// Returns a wavy floor as lines of an OBJ.
function floor(edge) {
    const lines = [];
    for (let z = 0; z <= edge; ++z)
        for (let x = 0; x <= edge; ++x)
            lines.push(`v ${4 * x / edge} ${0.1 * Math.sin(9 * x / edge) * Math.cos(7 * z / edge)} ${3 * z / edge}`,
                `vt ${1.5 * x / edge} ${z / edge}`);
    lines.push('usemtl floor');
    const corner = (x, z) => { const n = 1 + z * (edge + 1) + x; return `${n}/${n}`; };
    for (let z = 0; z < edge; ++z)
        for (let x = 0; x < edge; ++x)
            lines.push(`f ${corner(x, z)} ${corner(x, z + 1)} ${corner(x + 1, z)}`,
                `f ${corner(x + 1, z)} ${corner(x, z + 1)} ${corner(x + 1, z + 1)}`);
    return lines;
}

const folder = process.argv[2], [edge, width] = process.argv.slice(3, 5).map(Number), hasChannels = process.argv[5] === 'channels';
fs.writeFileSync(path.join(folder, 'tiles.png'), png(width, width * 3 / 4, tiles));
fs.writeFileSync(path.join(folder, 'wall.png'), png(Math.floor(width * 0.3), Math.floor(width * 0.2), wall));
if (hasChannels) fs.writeFileSync(path.join(folder, 'normals.png'), png(256, 256, (x, y) => [wave(x, 3) * 0.4 + 77, wave(y, 4) * 0.4 + 77, 230]));
fs.writeFileSync(path.join(folder, 'textured.mtl'), ['newmtl floor', 'map_Kd tiles.png', ...hasChannels ? ['norm normals.png', 'Pr 0.4'] : [],
    'newmtl wall', 'map_Kd wall.png', ...hasChannels ? ['map_Ke wall.png', 'Ke 0.3 0.2 0.1'] : [], ''].join('\n'));
const back = ['v 0 -0.2 0', 'vt 0 0', 'v 4 -0.2 0', 'vt 1 0', 'v 4 2 0', 'vt 1 1', 'v 0 2 0', 'vt 0 1', 'usemtl wall', 'f -4/-4 -3/-3 -2/-2',
    'f -4/-4 -2/-2 -1/-1'];
fs.writeFileSync(path.join(folder, 'textured.obj'), ['mtllib textured.mtl', ...floor(edge), ...back, ''].join('\n'));
