// Display settings of the user.

/** Slices of the image volume: along x (sagittal), y (coronal) and z (axial). */
export interface VolumeSettings {
  planes: [boolean, boolean, boolean];
  /** Positions along the volume's box, 0 … 1. */
  shares: [number, number, number];
  /** The middle of the greys and their range, in the volume's values. */
  level: number;
  width: number;
}

export interface Settings {
  version: number;
  opacity: number;
  colour: 'none' | 'displacement' | 'dose';
  wireframe: boolean;
  points: boolean;
  structures: boolean;
  /** Structures that the legend has switched off; "prostate" is the tissue. */
  hidden: ReadonlySet<string>;
  volume: VolumeSettings;
  template: boolean;
  plan: boolean;
  clip: boolean;
  clipAxis: 0 | 1 | 2;
  /** Position along the gland's bounding box, 0 … 1. */
  clipShare: number;
  /** False: the lower side is shown; true: the upper one. */
  clipFlipped: boolean;
  field: boolean;
  /** Events and the verdict as the daemon words them. */
  terms: boolean;
  /** Template hole of the manually moved needle; '' is none. */
  hole: string;
}

export const defaultSettings = (): Settings => ({
  version: 0, opacity: 0.6, colour: 'displacement', wireframe: false, points: false, structures: true, hidden: new Set<string>(),
  volume: {planes: [false, false, false], shares: [0.5, 0.5, 0.5], level: 0, width: 1}, template: true,
  plan: true, clip: false, clipAxis: 1, clipShare: 0.5, clipFlipped: false, field: true, terms: false, hole: '',
});

/** Points inside the tissue are requested only where they are shown. */
export const wantsVolume = (settings: Settings): boolean => settings.points || (settings.clip && settings.field);
