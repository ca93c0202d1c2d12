// Types of what the modules of the page hand one another. `tests/scripts` checks them; they are never served.

import type { Tensor } from "./model/tensors.js";

export type Settings = typeof import("./model/state.js").DEFAULTS;

/** Points with what is known at them. */
export interface Cloud {
  name: string;
  points: Tensor;
  normals?: Tensor;
  /** Values of the points by the names of their columns. */
  values: Map<string, Float64Array>;
  /** Rows of the file that have no position. */
  nLeftOut?: number;
  /** The curve that the points were taken from. */
  exact?: number[][];
  /** The answer to the first question, which comes with the cloud. */
  known?: Answer;
  /** The name of the example. Absent for files. */
  example?: string;
  /** Rows that are equal to earlier ones. */
  repeats?: Uint32Array;
}

/** A cloud of a file with what stands in the way of computing with it. */
export interface ReadCloud extends Cloud {
  /** Rows without a position. */
  gaps?: Uint32Array;
  /** Rows whose normal has no direction. */
  undirected?: Uint32Array;
  /** Columns of text, which were left out. */
  textColumns?: string[];
  /** What the strict reader refused. */
  strictly?: string;
}

export interface Answer {
  tensors: Record<string, Tensor>;
  fields: Fields;
  seconds?: number;
  /** Milliseconds by stage. */
  timing?: Record<string, number>;
}

/** Members of an answer that are no tensors. */
export interface Fields {
  flags?: { query: number; reason: string }[];
  parts?: { euler_characteristic: number; n_boundary_edges: number }[];
  /** What each vertex of a mesh rests on. */
  support?: string[];
  closedness?: number;
  diagnostics?: Diagnostics;
}

/** How an answer was computed. */
export interface Diagnostics {
  solver?: string;
  kernel?: Record<string, string | number>;
  alpha?: number;
  reciprocal_condition?: number;
  warnings?: { code?: string; detail: string }[];
}

/** Numbers of all points under a name, as files have them. */
export interface Column {
  name: string;
  values: ArrayLike<number>;
}

/** Where a snippet has its points from: itself, or a file in the folder where it runs. */
export interface Source {
  inline?: { points: number[][]; normals?: number[][] };
  file?: string;
  mediaType?: string;
  /** Whether the page makes that file, which the user has not. */
  isMade?: boolean;
}

/** Numbers that points can be coloured by. */
export interface Quantity {
  id: string;
  title: string;
  unit: string;
  /** Whether 0 is in the middle of the colours, where there are values on both sides of it. */
  isSigned: boolean;
  values: ArrayLike<number>;
  deviations?: ArrayLike<number>;
  /** Red, green and blue from 0 to 255, of points that have colours of their own. */
  channels?: ArrayLike<number>[];
}

/** Places of values on a scale of colours, and the map that has the colours. */
export interface Scale {
  low: number;
  /** The value of the middle colour of a diverging map. A sequential map has none. */
  middle?: number;
  high: number;
  isLogarithmic: boolean;
  map: string;
}

/** How numbers become colours, and which points are hidden. */
export interface ColourRange extends Scale {
  /** The deviation at which a colour is grey. 0: no colour is. */
  full: number;
  /** The deviation beyond which a point is hidden. */
  hide: number;
  hasLines?: boolean;
}

/** A box of which the picture shows the inside, in coordinates of the cloud. */
export interface Box {
  low: number[];
  high: number[];
}

/** Queries that are marked for one reason, and the colour of the marks. */
export interface Marks {
  points: number[];
  colour: number[];
}

/** How far a job is. */
export interface Progress {
  stage?: string;
  fraction?: number;
  seconds_left?: number;
}

/** A problem document. */
export interface Problem {
  type?: string;
  title: string;
  detail: string;
  status?: number;
  instance?: string;
  point_indices?: number[];
  limit?: number;
  required?: number;
  minimum_alpha?: number;
  errors?: { pointer: string }[];
}

/** What can be done about a refusal: a label, and the settings that it sets or the event that it causes. */
export interface Remedy {
  label: string;
  set?: Partial<Settings>;
  act?: string;
}

/** Everything that the page remembers. */
export interface PageState {
  settings: Settings;
  cloud?: Cloud;
  /** The cloud of the file that was opened last. */
  own?: Cloud;
  /** The id of the cloud, once it is registered. */
  cloudId?: string;
  answer?: Answer;
  quantities: Quantity[];
  /** Marks of the answer by reason, and the reason of each marked point. */
  reasons: Map<string, Marks>;
  reasonOf: Map<number, string>;
  /** Reasons whose marks are hidden. */
  hidden: Set<string>;
  /** The pinned point. */
  point?: number;
  /** The operation of the answer on screen. */
  shown?: string;
  language: string;
  /** What is under way: a cloud that is loaded, a question, a section, a change of the link. */
  loading?: object;
  asking?: AbortController;
  cutting?: AbortController;
  keeping?: number;
}

/** The elements of index.html by their ids. */
export interface Elements {
  settings: HTMLFormElement;
  cloud: HTMLElement;
  cleaning: HTMLElement;
  file: HTMLInputElement;
  bySupport: HTMLInputElement;
  scaleSlider: HTMLInputElement;
  alphaSlider: HTMLInputElement;
  hideText: HTMLElement;
  key: HTMLInputElement;
  keyPart: HTMLDetailsElement;
  keyHint: HTMLElement;
  scene: HTMLCanvasElement;
  scale: HTMLElement;
  tip: HTMLElement;
  labels: HTMLElement;
  axes: HTMLCanvasElement;
  measure: HTMLButtonElement;
  measured: HTMLElement;
  unitOfLength: HTMLElement;
  progress: HTMLElement;
  cancel: HTMLButtonElement;
  refusal: HTMLElement;
  summary: HTMLElement;
  title: HTMLElement;
  histogram: HTMLCanvasElement;
  marks: HTMLElement;
  support: HTMLElement;
  pinned: HTMLElement;
  link: HTMLButtonElement;
  languages: HTMLElement;
  needs: HTMLElement;
  code: HTMLElement;
  copy: HTMLButtonElement;
  diagnostics: HTMLElement;
  drop: HTMLElement;
}
