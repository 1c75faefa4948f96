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

/** What is drawn, of the pages that a view wants. */
export interface Detail {
    /** Nothing more is to come. */
    settled: boolean;
    /** By how many pixels the picture errs. */
    errorPixels: number;
    /** Edge of the widest parts whose colours are off by more than `colour-error`, in pixels. */
    colourPixels: number;
    /** Which of the two is larger, and so is refined next. */
    limitedBy: 'geometry' | 'colour';
    /** The budget keeps the picture coarser than the view asks for. */
    relaxed: boolean;
    residentBytes: number;
    pagesInCut: number;
    pagesMissing: number;
    /** Reads that failed, and were or will be tried again. */
    failures: number;
}

/** A picture that is shown. */
export interface Progress extends Detail {
    width: number;
    height: number;
    /** Rays a pixel. */
    samples: number;
    /** Of the scan, since it was opened. */
    requests: number;
    bytes: number;
    /** Of all workers. */
    memoryBytes: number;
    gpuBytes: number;
    workers: number;
    drawnBy: 'processor' | 'webgl';
    ms: number;
}

export interface VcpViewerEventMap {
    load: CustomEvent<{ info: ScanInfo }>;
    progress: CustomEvent<Progress>;
    settled: CustomEvent<Detail>;
    pick: CustomEvent<Hit>;
    error: CustomEvent<{ message: string }>;
}

/**
 * `<vcp-viewer src annotations mode theme budget workers draw light environment shadows occlusion plain section up
 * colour-error>`.
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
    addEventListener<Type extends keyof VcpViewerEventMap>(type: Type,
        listener: (this: VcpViewer, event: VcpViewerEventMap[Type]) => void, options?: boolean | AddEventListenerOptions): void;
    addEventListener(type: string, listener: EventListenerOrEventListenerObject, options?: boolean | AddEventListenerOptions): void;
}

declare global {
    interface HTMLElementTagNameMap {
        'vcp-viewer': VcpViewer;
    }
}
