// Display settings of the user.
export interface Settings {
  version: number;
  opacity: number;
  colour: 'none' | 'displacement' | 'dose';
  wireframe: boolean;
  points: boolean;
  structures: boolean;
  template: boolean;
  plan: boolean;
  clip: boolean;
  clipAxis: 0 | 1 | 2;
  /** Position along the gland's bounding box, 0 … 1. */
  clipShare: number;
  /** False: the lower side is shown; true: the upper one. */
  clipFlipped: boolean;
  field: boolean;
  /** Template hole of the manually moved needle; '' is none. */
  hole: string;
}

export const defaultSettings = (): Settings => ({
  version: 0, opacity: 0.6, colour: 'displacement', wireframe: false, points: false, structures: true, template: true,
  plan: true, clip: false, clipAxis: 1, clipShare: 0.5, clipFlipped: false, field: true, hole: '',
});

/** Points inside the tissue are requested only where they are shown. */
export const wantsVolume = (settings: Settings): boolean => settings.points || (settings.clip && settings.field);
