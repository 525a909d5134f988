// Recordings: good ones, cut-off ones, damaged ones, and going to and fro in them.
import assert from 'node:assert/strict';
import {test} from 'node:test';
import {goldenRecording} from './golden.mjs';
import {event, frame, recording, topology} from './messages.mjs';
import {viewer} from './viewer_module.mjs';

const START = 1e9;
const FRAMES = 200;
const stamp = (i) => START + i * 1e8;  // ten a second
const messages = [
  topology,
  ...Array.from({length: FRAMES}, (_, i) => frame(i + 1, stamp(i), i, i === 0)),
];
messages.splice(101, 0, event(stamp(99) + 1, 'half way'));

const entriesOf = (file) => {
  const reader = new viewer.RecordingReader(file);
  let count = 0;
  while (reader.next()) ++count;
  return {count, damage: reader.damage};
};
const open = async (file) => {
  const session = new viewer.Session();
  return {session, player: await viewer.Player.open('test.brachy', new Uint8Array(file), session, () => {})};
};
const x = (session) => session.assembler.positions[0];

test('a check sum is that of zlib', () => {
  assert.equal(viewer.crc32(new TextEncoder().encode('123456789')), 0xcbf43926);
});

test("the page's file is read to its end", () => {
  const {count, damage} = entriesOf(goldenRecording);
  assert.ok(count > 0);
  assert.equal(damage, '');
});

test('a whole file is read to its end', () => {
  assert.deepEqual(entriesOf(recording(messages)), {count: messages.length, damage: ''});
});

test('the lag of the tissue is played with it', async () => {
  const {session, player} = await open(recording([topology, frame(1, stamp(0), 1, true), frame(2, stamp(1), 2, false, 0.375), frame(3, stamp(2), 3)]));
  for (const [i, lagMm, text] of [[0, null, ''], [1, 0.375, ' · 0.38 mm late'], [2, null, '']]) {
    player.seek(i / 10 + 0.01);
    assert.equal(session.frame.lagMm, lagMm);
    assert.equal(viewer.lateText(session.frame), text);
  }
});

test('a file that ends anywhere in its last message is good up to there, and says so', () => {
  const short = [topology, frame(1, START, 1, true)];
  const whole = recording(short);
  const before = recording(short.slice(0, 1)).length;
  for (let length = before + 1; length < whole.length; ++length) {
    const {count, damage} = entriesOf(whole.subarray(0, length));
    assert.equal(count, 1);
    assert.match(damage, /middle of a message after 1 good messages/);
  }
});

test('a wrong check sum ends the file there', () => {
  const file = recording(messages);
  file[file.length - 20] ^= 1;
  assert.deepEqual(entriesOf(file).count, messages.length - 1);
  assert.match(entriesOf(file).damage, /wrong check sum/);
});

test('another file is refused', () => {
  assert.throws(() => new viewer.RecordingReader(new TextEncoder().encode('<VTKFile>')), /no brachy recording/);
  assert.throws(() => new viewer.RecordingReader(new Uint8Array()), /no brachy recording/);
});

test('a recording without a snapshot is refused', async () => {
  await assert.rejects(open(recording([topology])), /holds no snapshot/);
});

test('seeking shows the mesh of that time, to and fro', async () => {
  const {session, player} = await open(recording(messages));
  assert.ok(Math.abs(player.durationS - (FRAMES - 1) / 10) < 1e-9);
  assert.equal(x(session), 0);
  for (const i of [3, 150, 20, 199, 0, 61, 60, 59]) {
    player.seek(i / 10 + 0.01);
    assert.equal(x(session), i, `frame ${i}`);
    assert.equal(session.frame.tick, i + 1);
    assert.equal(session.events.length, i > 99 ? 1 : 0);
  }
});

test('playing keeps the pace it is given and stops at the end', async () => {
  const {session, player} = await open(recording(messages));
  player.speed = 2;
  player.play();
  player.advance(1);
  assert.equal(x(session), 20);
  player.advance(100);
  assert.equal(x(session), FRAMES - 1);
  assert.equal(player.playing, false);
  player.play();
  assert.equal(player.positionS, 0);
});

const eventOf = (kind, stampNs, text) => event(stampNs, text, kind);

test('marks are what the tissue and the seeds did, and missed ticks that belong together are one', async () => {
  const {EventKind} = viewer.wire;
  const file = recording([topology, frame(1, stamp(0), 1, true), eventOf(EventKind.Puncture, stamp(0) + 1, 'capsule punctured'), eventOf(EventKind.Note, stamp(0) + 2, 'a note'),
    frame(2, stamp(1), 2), eventOf(EventKind.Structure, stamp(1) + 1, 'the needle entered the urethra'), eventOf(EventKind.Seed, stamp(2), 'seed 1 dropped')]);
  const {player} = await open(file);
  assert.deepEqual(player.marks.map(({kind, text}) => [kind, text]), [['puncture', 'capsule punctured'], ['organ', 'the needle entered the urethra'], ['drop', 'seed 1 dropped']]);
  const missed = new viewer.MissedTicks();
  for (const [overruns, timeS] of [[7, 0], [7, 1], [9, 2], [10, 2.5], [10, 5], [11, 6]]) missed.add(overruns, timeS);
  assert.deepEqual(missed.marks, [{timeS: 2, kind: 'missed', text: '3 ticks missed'}, {timeS: 6, kind: 'missed', text: '1 tick missed'}]);
});

test('findings are read from a report, with their time where it says one', () => {
  const report = viewer.reportOf({findings: [{text: 'deep', at_s: 2.5}, {text: 'goals', at_s: null}], seeds: {each: [{seed: 1, t_s: 2}, {seed: 2, t_s: 3}]}});
  assert.deepEqual(report.findings, [{text: 'deep', atS: 2.5}, {text: 'goals', atS: null}]);
  assert.throws(() => viewer.reportOf({}), /no report/);
  const drop = (id, timeS) => ({kind: 'drop', timeS, text: `seed ${id} dropped, at rest at (0, 0, 0) mm`});
  assert.equal(viewer.clockOffsetS(report, [drop(1, 1.5), drop(2, 2.5), drop(7, 9)]), -0.5, 'the recording began half a second later');
  assert.equal(viewer.clockOffsetS(report, []), null);
  const named = (...names) => names.map((name) => ({name}));
  assert.deepEqual(viewer.sessionFiles(named('poses.csv', 'recording_0.brachy', 'report.json')), {recording: {name: 'recording_0.brachy'}, report: {name: 'report.json'}});
  assert.deepEqual(viewer.sessionFiles(named('poses.csv', 'seeds.csv')), {recording: null, report: null});
});

test('the last minutes of a session are kept, within their time and bytes, and play from a mesh that was not sent whole', async () => {
  const feed = (kept) => {
    const sent = [topology, ...Array.from({length: 300}, (_, i) => frame(i + 1, stamp(i), i, i === 0))];
    for (const bytes of sent) {
      const whole = new Uint8Array(bytes);
      kept.add(viewer.decodeMessage(whole), whole);
    }
    return kept;
  };
  const byTime = feed(new viewer.LastMinutes(1e9, 12));
  assert.ok(byTime.seconds > 11 && byTime.seconds <= 18, `${byTime.seconds} s`);
  const {entries, base} = byTime.recording();
  const session = new viewer.Session();
  const player = await viewer.Player.openEntries('kept', entries, session, () => {}, () => {}, {base});
  assert.equal(player.damage, '');
  player.seek(player.durationS);
  assert.equal(x(session), 299);
  player.seek(0);
  assert.equal(session.frame.tick, 300 - Math.round(10 * player.durationS));
  assert.equal(x(session), session.frame.tick - 1, 'the oldest that is kept, though it is no full frame');

  const most = 20_000;
  const byBytes = feed(new viewer.LastMinutes(most, 1e9));
  assert.ok(byBytes.bytes <= most && byBytes.bytes > most / 4, `${byBytes.bytes} bytes`);
  assert.ok(byBytes.seconds < 29);
  const again = frame(1, stamp(300), 5, true);
  byTime.add(viewer.decodeMessage(new Uint8Array(again)), new Uint8Array(again));
  assert.equal(byTime.seconds, 0, 'a simulation that begins again is another session');
});

test('a damaged end is said and the rest plays', async () => {
  const whole = recording(messages);
  const {session, player} = await open(whole.subarray(0, whole.length - 10));
  assert.match(player.damage, /middle of a message/);
  player.seek(1e9);
  assert.equal(x(session), FRAMES - 2);
});

test('a message that does not fit ends the recording there', async () => {
  const {session, player} = await open(recording([topology, frame(1, stamp(0), 1, true), frame(2, stamp(1), 2), frame(9, stamp(2), 9), frame(10, stamp(3), 10)]));
  assert.match(player.damage, /Message 4 of the file is invalid/);
  player.seek(1e9);
  assert.equal(x(session), 2);
});
