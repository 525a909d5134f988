// Sessions of a class, played in real time by brachyd's script into a directory of attempts: each with one planted mistake.
import {execFile} from 'node:child_process';
import {mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';
import {promisify} from 'node:util';

const ORIGIN = [-30, -30, -60];  // of the default template, mm
const SPACING_MM = 5;
const OUTSIDE_MM = -65;
const IN_MM_S = 70;
const OUT_MM_S = 25;
const BASE_PLANE_MM = 82;
const TRAIN = 's-s';
const TRAIN_MM = 4.5 + 5.5 + 4.5;

const at = (hole) => [ORIGIN[0] + SPACING_MM * (hole.charCodeAt(0) - 'A'.charCodeAt(0)), ORIGIN[1] + SPACING_MM * (Number(hole.slice(1)) - 1)];
const NEEDLES = [{hole: 'E8', tip: ORIGIN[2] + BASE_PLANE_MM - 6}, {hole: 'I8', tip: ORIGIN[2] + BASE_PLANE_MM - 6}];

/** Keyframes of a needle along the template. */
class Hand {
  rows = [];

  go([x, y], z, mmPerS, button = 0) {
    let t = 0;
    if (this.rows.length > 0) {
      const before = this.rows.at(-1);
      before[4] = button;
      t = before[0] + Math.max(Math.hypot(x - before[1], y - before[2], z - before[3]) / mmPerS, 0.1);
    }
    this.rows.push([t, x, y, z, button]);
    return t;
  }

  /** Leaves `share` of a train. Returns when the first seed falls, about. */
  implant(hole, tip, {share = 1, outMmS = OUT_MM_S} = {}) {
    this.go(at(hole), OUTSIDE_MM, 2 * IN_MM_S);
    this.go(at(hole), tip, IN_MM_S);
    const begins = this.go(at(hole), tip, IN_MM_S);
    this.go(at(hole), tip - share * TRAIN_MM - 0.5, outMmS, 1);
    this.go(at(hole), tip - share * TRAIN_MM - 0.5, outMmS);
    this.go(at(hole), OUTSIDE_MM, IN_MM_S);
    return begins;
  }

  /** In and out. Returns when it goes in, about. */
  puncture(hole, tip) {
    this.go(at(hole), OUTSIDE_MM, 2 * IN_MM_S);
    const begins = this.rows.at(-1)[0];
    this.go(at(hole), tip, IN_MM_S);
    this.go(at(hole), OUTSIDE_MM, IN_MM_S);
    return begins;
  }

  text() {
    return ['t_s,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23,button', ...this.rows.map(([t, x, y, z, button]) => `${t},1,0,0,${x},0,1,0,${y},0,0,1,${z},${button}`), ''].join('\n');
  }
}

const [FIRST, SECOND] = NEEDLES;
/** What each hand does: it returns when the mistake was made, within `within` seconds, and through which hole. */
export const MISTAKES = {
  deep: {says: /too deep/, within: 1.5, play: (hand) => {
    hand.implant(FIRST.hole, FIRST.tip);
    return {hole: SECOND.hole, s: hand.implant(SECOND.hole, SECOND.tip + 7)};
  }},
  urethra: {says: /the urethra was entered/, within: 2, play: (hand) => {
    hand.implant(FIRST.hole, FIRST.tip);
    const s = hand.puncture('G7', 0);
    hand.implant(SECOND.hole, SECOND.tip);
    return {hole: 'G7', s};
  }},
  shallow: {says: /too shallow/, within: 1.5, play: (hand) => {
    const s = hand.implant(FIRST.hole, FIRST.tip - 7);
    hand.implant(SECOND.hole, SECOND.tip);
    return {hole: FIRST.hole, s};
  }},
  wrong_hole: {says: /went through/, within: 1.5, loading: 'order', play: (hand) => {
    hand.implant(FIRST.hole, FIRST.tip);
    return {hole: 'J8', s: hand.implant('J8', SECOND.tip)};
  }},
  half: {says: /missing/, within: 2.5, play: (hand) => {
    const s = hand.implant(FIRST.hole, FIRST.tip, {share: 0.4});
    hand.implant(SECOND.hole, SECOND.tip);
    return {hole: FIRST.hole, s};
  }},
  twice: {says: /entered again/, within: 2, play: (hand) => {
    hand.implant(FIRST.hole, FIRST.tip);
    const s = hand.puncture(FIRST.hole, 0);
    hand.implant(SECOND.hole, SECOND.tip);
    return {hole: FIRST.hole, s};
  }},
  rectum: {says: /the rectum was entered/, within: 2, play: (hand) => {
    hand.implant(FIRST.hole, FIRST.tip);
    hand.implant(SECOND.hole, SECOND.tip);
    return {hole: 'G1', s: hand.puncture('G1', 0)};
  }},
  in_vain: {says: /without a seed/, within: 2, play: (hand) => {
    const s = hand.puncture('F10', 0);
    hand.implant(FIRST.hole, FIRST.tip);
    hand.implant(SECOND.hole, SECOND.tip);
    return {hole: 'F10', s};
  }},
  hasty: {says: /too fast/, within: 1.5, play: (hand) => {
    hand.implant(FIRST.hole, FIRST.tip);
    return {hole: SECOND.hole, s: hand.implant(SECOND.hole, SECOND.tip, {outMmS: 300})};
  }},
  other_hand: {says: /too deep/, within: 1.5, play: (hand) => {  // the needles in the other order
    hand.implant(SECOND.hole, SECOND.tip);
    return {hole: FIRST.hole, s: hand.implant(FIRST.hole, FIRST.tip + 8)};
  }},
};
const AS_PLANNED = {play: (hand) => {
  for (const {hole, tip} of NEEDLES) hand.implant(hole, tip);
  return null;
}};

const mistakeOf = (name) => MISTAKES[name] ?? AS_PLANNED;

/** The scene of an exercise with two needles on a small phantom, in which the script moves as `name` does. */
export function writeExercise(folder, name = 'as_planned') {
  mkdirSync(folder, {recursive: true});
  const {play, loading = 'hole'} = mistakeOf(name);
  const hand = new Hand();
  const planted = play(hand);
  writeFileSync(join(folder, `${name}.csv`), hand.text());
  writeFileSync(join(folder, 'plan.toml'), ['name = "two"', 'source = "6711"', 'air_kerma_strength_u = 0.502', 'prescription_gy = 145', `base_plane_mm = ${BASE_PLANE_MM}`,
    ...NEEDLES.map(({hole}) => `[[needle]]\nhole = "${hole}"\nretraction_mm = 6\ntrain = "${TRAIN}"`), ''].join('\n'));
  const scene = join(folder, `scene_${name}.toml`);
  writeFileSync(scene, `name = "two"\n[tissue]\npoints = 3000\nphantom_surface_vertices = 400\n[model]\nkernel = "psi31"\n[device]\nkind = "scripted"\ntrajectory = "${name}.csv"\nloop = false\n[plan]\nfile = "plan.toml"\n[seeds]\napplicator = "train"\nloading = "${loading}"\n`);
  writeFileSync(join(folder, `${name}.toml`), `name = "two needles"\nasks = "Leave two seeds through each hole."\nscene = "scene_${name}.toml"\n[passes]\nplaced_at_least = 4\nmean_error_mm_at_most = 3\norgan_passes_at_most = 0\ninsertions_at_most = 2\n`);
  return {scene, planted, lastS: hand.rows.at(-1)[0]};
}

/** By how much simulated time fell behind, s, in a recorded session. */
function lateS(session) {
  const last = readFileSync(join(session, 'clock.csv'), 'utf8').trimEnd().split('\n').at(-1).split(',').map(Number);
  return last[1] - last[0];
}
const MOST_LATE_S = 0.4;
const TRIES = 8;

/** Plays a session, `name` of MISTAKES or 'as_planned', into `sessions`. Resolves to what it planted: {hole, s}, `s` on the clock of the
 * hand, or null. A hand moves in real time: on a machine that misses ticks seeds are missed, too, and it is played again. */
export async function playSession(folder, sessions, name, trainee) {
  const {scene, planted, lastS} = writeExercise(folder, name);
  let late = 0;
  for (let tries = 0; tries < TRIES; ++tries) {
    await promisify(execFile)(process.env.BRACHYD ?? 'build/release/bin/brachyd',
      ['--config', scene, '--port', '0', '--sessions', sessions, '--trainee', trainee, '--duration', String(lastS + 0.3)]);
    const session = join(sessions, readdirSync(sessions).sort().at(-1));
    late = lateS(session);
    if (late < MOST_LATE_S) return planted;
    rmSync(session, {recursive: true});
  }
  throw new Error(`this machine is too busy to play a session: simulated time fell ${late.toFixed(1)} s behind`);
}
export const xyOf = at;
