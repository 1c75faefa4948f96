// Makes the product's shaders into those of WebGL 2: expand.mjs ROOT FOLDER OUT GLSLANG
// ROOT: of the project. OUT: the ES module to write, `shader(name)`. FOLDER: for each shader as GLSLANG checks it, and
// for shaders.d, what they were made of.
// A pass for compute becomes a fragment shader of the same main: files of this folder take the place of those of their
// name in render/shaders, what it writes goes to targets at the end, and constant N of it is SPEC_N, which whoever
// compiles it may define.
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import path from 'node:path';

const [root, folder, out, glslang] = process.argv.slice(2);
const here = path.join(root, 'viewer/web/shaders');

/// What each pass writes: targets, and what goes there, with what stands there where main returns early.
const kPasses = {
    beam: { start: 'storedStart' },
    trace: { hit: 'uvec4(storedHit.xyz, kFalseColour != 0u ? storedHit.w : storedMark)', channels: 'storedChannels' },
    light: { light: 'storedHit.w' },
    shade: { picture: 'storedPicture' },
    accumulate: { sum: 'floatBitsToUint(storedSum)', shown: 'storedShown' },
};
const kBefore = {
    trace: 'storedHit.x = floatBitsToUint(kNoHit);',
    light: 'storedHit.w = 0xffffu;',
    shade: 'storedPicture = texelFetch(rowColours, ivec2(0, ownPlace().y), 0).x;',
};
const kMore = { shade: 'uniform usampler2D rowColours;' };
const kWide = new Set(['hit', 'channels', 'sum']);

const made = new Set([process.argv[1]]); // of these files
function read(name) {
    const own = path.join(here, name.replace('render/shaders/', '')), file = fs.existsSync(own) ? own : path.join(root, name);
    made.add(file);
    return fs.readFileSync(file, 'utf8');
}
/// What the constants of a shader are where nobody defines them.
function withConstants(text) {
    return text.replace(/layout\(constant_id = (\d+)\) const uint (\w+) =\s*(\w+);/g, (_, id, name, value) =>
        `#ifndef SPEC_${id}\n#define SPEC_${id} ${value}\n#endif\nconst uint ${name} = SPEC_${id};`);
}
/// A file in the language of WebGL: as short as it can be.
function translated(text) {
    return withConstants(text.replace(/[ \t]*\/\/.*$/gm, ''))
        .replace(/^#(version|extension).*$/gm, '')
        .replace(/^layout\(local_size.*$/gm, '')
        .replace(/\bprecise /g, '')
        .replace(/\n\s*/g, '\n')
        .trim();
}
function fragment(name) {
    const targets = Object.entries(kPasses[name]);
    const outs = targets.map(([target], i) => `layout(location = ${i}) out ${kWide.has(target) ? 'uvec4' : 'uint'} ${target}Out;`);
    const ends = targets.map(([target, value]) => `${target}Out = ${value};`);
    return `#include "dialect.glsl"
${outs.join('\n')}
${read(`render/shaders/${name}.comp`).replace('void main()', 'void pass()')}
${kMore[name] ?? ''}
void main() { ${kBefore[name] ?? ''} pass(); ${ends.join(' ')} }`;
}

const files = {};
/// Keeps a file with all that it includes.
function keep(name, text) {
    files[name] = translated(text);
    for (const [, included] of text.matchAll(/^#include "([^"]+)"$/gm))
        if (!(included in files)) keep(included, read(included));
}
const kShaders = [];
function add(name, text) {
    kShaders.push(name);
    keep(name, text);
}
for (const name of Object.keys(kPasses)) add(`${name}.frag`, fragment(name));
for (const name of ['show.frag', 'probe.frag', 'marks.frag', 'marks.vert', 'whole.vert']) add(name, read(name));

// The same as browsers do.
const code = `const files = ${JSON.stringify(files, null, 1)};
/// Returns the text of a shader, from its second line on.
export function shader(name) {
    return files[name].replace(/^#include "([^"]+)"$/gm, (_, included) => shader(included));
}
`;
fs.writeFileSync(out, code);
const { shader } = await import(`data:text/javascript,${encodeURIComponent(code)}`);
for (const name of kShaders) {
    const file = path.join(folder, name);
    const text = shader(name), highp = text.indexOf('precision highp int');
    // Whole numbers have 16 bits on phones otherwise.
    if (name.endsWith('.frag') && !(highp >= 0 && highp < text.search(/\b(u?int|[iu]vec\d)\b(?!;)/)))
        throw new Error(`${name}: no "precision highp int" before the first whole number`);
    fs.writeFileSync(file, `#version 300 es\n${text}\n`);
    try {
        execFileSync(glslang, ['--quiet', file], { encoding: 'utf8' });
    } catch (error) {
        fs.rmSync(out);
        console.error(error.stdout);
        process.exit(1);
    }
}
fs.writeFileSync(path.join(folder, 'shaders.d'), `${out}: ${[...made].join(' ')}\n`);
