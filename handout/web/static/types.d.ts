/** What the server answers, and what modules of the studio hand each other. */
export type Child = Node | string | number | null | undefined | false | Child[];
export type Properties = Record<string, any> | null;
export type Point = [number, number];
/** Left, top, right, low. */
export type Box = [number, number, number, number];
export type Hand = { name: string; title: string; about: string; drawn: boolean; own: boolean; scans?: boolean; removable?: boolean };
export type Named = { name: string; title: string };
export type Machine = Named & { away?: number };
export type Choices = { hands: Hand[]; pens: string[]; papers: string[]; pages: string[]; styles: string[]; plotters: Named[] };
export type Shared = { choices: Choices; refresh(): Promise<void> };
export type Show = (main: HTMLElement, shared: Shared, rest: string[]) => Promise<(() => void) | null | undefined | void>;
export type Machines = { queues: string[]; printers: Named[]; plotters: Machine[]; ports: Named[] };
export type Place = { page: number; stroke: number; time: number | null };
/** A task: `facts` are what came of it. */
export type Snapshot = { id: string; state: string; share: number; stage: string; said?: string[]; error?: string; facts: any; live?: { question?: string; place?: Place } };
export type Heard = (snapshot: { state?: string; share?: number; stage?: string }) => void;
export type Run = <Done>(work: (heard: Heard, signal: AbortSignal) => Promise<Done>) => Promise<Done>;
export type Row = { row: number; called: string; state: string; why: string[]; filled?: string };
export type Word = { word: string; at: number; page: number; box: Box | null };
export type Doubt = { word: string; page: number; line: number; reads_as: string; box: Box | null };
export type Written = { pages: number; page?: number; lines: number; strokes: number; duration_s: number; seed: number; files: string[]; x_height?: number; words?: Word[]; doubtful?: Doubt[]; notes?: string[]; borrowed?: { letter: string; own: boolean; from: string }[] };
export type Done = Omit<Snapshot, 'facts'> & { facts: Written };
export type Plot = {
  job: string; title?: string; device: string; sheets: number; pen_down_mm: number; drawn_mm: number; finished: boolean; stopped?: string; outlook?: string; task?: string;
  runs: unknown[]; place: Place | null; bed: Point; page: Point; lies?: { matrix: number[]; zero: Point; quarters: number; turned?: string };
  pens?: { layer: string; pen: string; speed: number; out: boolean; ink_mm: number; seconds: number; drawn: boolean; next: boolean }[];
};
export type Batch = {
  batch: string; title: string; state: 'new' | 'proofed' | 'approved' | 'broken off' | 'done'; to: 'pdf' | 'printer' | 'plotter'; printer?: string; queues: string[]; count: number; rows: Row[]; left_out: number[]; letters: boolean; envelopes: boolean;
  proof: { made?: string; rows?: number; failed?: unknown[]; look_at?: { row: number; why: string[] }[]; pages_shown?: { row: number; part: string; picture: string }[] };
  file?: string; task?: string; ended?: string; rehearsed?: boolean; test?: boolean; webhook?: { why?: string };
};
export type Table = { count: number; rows: Row[]; notes: string[]; numbers: number[]; columns: { name: string; header: string }[]; no_envelopes?: string };
