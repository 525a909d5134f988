// What the person at the screen has chosen to see.
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
  /** 0 … 1 through the gland's box. */
  clipShare: number;
  /** Which side is kept: the lower one, or if so the upper one. */
  clipFlipped: boolean;
  field: boolean;
  /** Of the template, for the needle by hand; '' is none. */
  hole: string;
}

export const defaultSettings = (): Settings => ({
  version: 0, opacity: 0.6, colour: 'displacement', wireframe: false, points: false, structures: true, template: true,
  plan: true, clip: false, clipAxis: 1, clipShare: 0.5, clipFlipped: false, field: true, hole: '',
});

/** Points inside the tissue are only asked for where they are shown. */
export const wantsVolume = (settings: Settings): boolean => settings.points || (settings.clip && settings.field);
