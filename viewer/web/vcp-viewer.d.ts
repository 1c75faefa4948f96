/** What a scan is. Lengths are the mesh's own units. */
export interface ScanInfo {
    boundsMin: [number, number, number];
    boundsMax: [number, number, number];
    cell: number;
    levels: number;
    triangles: number;
    /** Largest distance between the mesh and the finest surface that is drawn. */
    certifiedError: number;
    hasColour: boolean;
    pages: number;
}

/** What is seen at a place of the picture. */
export interface Hit {
    position: [number, number, number];
    depth: number;
    /** By how much the surface that is drawn may be off there. */
    error: number;
}

export interface Annotation {
    position: [number, number, number];
    title?: string;
    text?: string;
}

export type ShadingMode = 'lit' | 'clay' | 'unlit' | 'normals' | 'level' | 'error' | 'wireframe';

/**
 * `<vcp-viewer src annotations mode theme budget workers draw light environment shadows occlusion plain section up>`;
 * events: load, progress, settled, pick, error.
 */
export class VcpViewer extends HTMLElement {
    src: string | null;
    mode: ShadingMode;
    /** The camera as text, as in links. */
    camera: string;
    readonly info: ScanInfo | null;
    fit(): void;
    /** `x`, `y`: pixels of CSS from the element's upper left corner. */
    pick(x: number, y: number): Promise<Hit | null>;
}

declare global {
    interface HTMLElementTagNameMap {
        'vcp-viewer': VcpViewer;
    }
}
