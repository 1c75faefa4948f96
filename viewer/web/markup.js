// What the element is made of: its style and its parts.
export const kStyle = `
:host { display: block; position: relative; container-type: inline-size; width: 100%; height: 100%; min-height: 160px; overflow: hidden;
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
svg text { fill: #fff; stroke: #000c; stroke-width: 3.5; paint-order: stroke; stroke-linejoin: round; font-weight: 600;
    text-anchor: middle; font-variant-numeric: tabular-nums; }
svg path { stroke: #ffd24d; stroke-width: 2; }
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
.note { position: absolute; left: 0; top: 0; transform: translate(-50%, -50%); width: 26px; height: 26px; min-width: 0; padding: 0;
    border-radius: 50%; background: var(--accent); color: #fff; font-size: 13px; font-weight: 600; box-shadow: 0 1px 6px #0006; }
:host([data-theme="dark"]) .note { color: #06192e; }
.card { position: absolute; right: 14px; top: 12px; width: min(300px, calc(100% - 28px)); box-sizing: border-box;
    padding: 14px 16px; border-radius: 12px; background: var(--raised); border: 1px solid var(--line); }
.card h2 { margin: 0 0 4px; font-size: 15px; } .card p { margin: 0; color: var(--dim); }
.panel { position: absolute; left: 50%; bottom: 76px; transform: translateX(-50%); width: min(340px, calc(100% - 28px));
    box-sizing: border-box; padding: 12px 16px; border-radius: 12px; background: var(--raised); border: 1px solid var(--line);
    backdrop-filter: blur(10px); display: grid; grid-template-columns: auto 1fr; gap: 6px 12px; align-items: center; }
.panel[hidden] { display: none; } .panel .wide { grid-column: 1 / 3; display: flex; justify-content: space-between; gap: 8px; }
.panel label { display: flex; gap: 7px; align-items: center; min-height: 32px; }
.panel input { accent-color: var(--accent); } .panel input[type="range"] { width: 100%; height: 32px; margin: 0; }
.corners { display: block; width: 15px; height: 15px; background:
    linear-gradient(currentColor 0 0) 0 0 / 6px 2px, linear-gradient(currentColor 0 0) 0 0 / 2px 6px,
    linear-gradient(currentColor 0 0) 100% 0 / 6px 2px, linear-gradient(currentColor 0 0) 100% 0 / 2px 6px,
    linear-gradient(currentColor 0 0) 0 100% / 6px 2px, linear-gradient(currentColor 0 0) 0 100% / 2px 6px,
    linear-gradient(currentColor 0 0) 100% 100% / 6px 2px, linear-gradient(currentColor 0 0) 100% 100% / 2px 6px;
    background-repeat: no-repeat; }
@container (max-width: 620px) { .scale { bottom: 78px; } .bar button, .bar select { padding: 0 9px; }
    .panel:not([hidden]) + .scale { display: none; } .card { top: 52px; } }
@container (min-width: 1100px) { .panel { left: auto; right: 14px; bottom: 14px; transform: none; } }
@media (prefers-reduced-motion: reduce) { * { transition: none !important; } }
`;

export const kMarkup = `
<canvas tabindex="0" role="application"
    aria-label="Three-dimensional view. Arrow keys turn, plus and minus zoom, shift and arrow keys move, F fits. M measures: Enter takes the middle of the view. Escape closes what is open."></canvas>
<svg aria-hidden="true"></svg>
<div class="notes"></div>
<div class="status" role="status" aria-live="polite"></div>
<div class="bar" role="toolbar" aria-label="View">
    <button data-do="fit" title="Show all (F)">Fit</button>
    <select aria-label="Shading"><option value="lit">Lit</option><option value="clay">Clay</option>
        <option value="unlit">Colours</option><option value="normals">Normals</option><option value="level">Levels</option>
        <option value="error">Error</option><option value="wireframe">Wireframe</option></select>
    <button data-do="measure" aria-pressed="false" title="Measure a distance (M)">Measure</button>
    <button data-do="more" aria-pressed="false" aria-expanded="false" title="Light, shadows, section">Light</button>
    <button data-do="link" title="Copy a link to this view">Link</button>
    <button data-do="full" title="Full screen" aria-label="Full screen"><span class="corners"></span></button>
</div>
<div class="panel" role="group" aria-label="Light and section" hidden>
    <span>Around</span><select data-set="environment" aria-label="Surroundings that light the scan">
        <option value="">a light</option><option value="studio">studio</option>
        <option value="overcast">overcast sky</option><option value="clear">clear sky</option></select>
    <span>Side</span><input type="range" data-set="side" aria-label="Side of the light, degrees" min="-180" max="180">
    <span>Height</span><input type="range" data-set="above" aria-label="Height of the light, degrees" min="-90" max="90">
    <div class="wide"><label><input type="checkbox" data-set="shadows">Shadows</label>
        <label><input type="checkbox" data-set="occlusion">Ambient occlusion</label>
        <label><input type="checkbox" data-set="plain">Plain materials</label></div>
    <span>Section</span><select data-set="axis" aria-label="Section plane"><option value="">none</option>
        <option value="x">x, keep beyond</option><option value="-x">x, keep before</option>
        <option value="y">y, keep beyond</option><option value="-y">y, keep before</option>
        <option value="z">z, keep beyond</option><option value="-z">z, keep before</option></select>
    <span>Place</span><input type="range" data-set="place" aria-label="Place of the section plane, hundredths" min="0" max="100">
</div>
<div class="scale" hidden><span></span></div>
<div class="card" role="note" aria-live="polite" hidden><h2></h2><p></p></div>`;
