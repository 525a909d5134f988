// The viewer's codec against the bytes that net/PROTOCOL.md shows, and its mesh by the rules of the native client's.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {test} from 'node:test';
import {HEADER, bodyOf, golden} from './golden.mjs';
import {viewer} from './viewer_module.mjs';

const schema = JSON.parse(readFileSync(new URL('../../net/protocol.json', import.meta.url), 'utf8'));
const decode = (name) => viewer.decodeMessage(golden.get(name)).body;

test('every message that a server sends is decoded, or skipped where the viewer has no use for it', () => {
  for (const [name, bytes] of golden) {
    const message = viewer.decodeMessage(bytes);
    const type = name.replace(/_(TOKEN|IMAGES|PLANNED)$/, '');  // some have a second example
    const fromServer = !['HELLO', 'POSE', 'ARM', 'DROP', 'CONTROL', 'LOAD', 'EXERCISE', 'LOCAL_MODEL'].includes(type);
    assert.equal(message.kind, fromServer ? type.toLowerCase() : 'other', name);
  }
});

test('a body that is cut short or has a byte too many is refused', () => {
  for (const [name, bytes] of golden) {
    if (viewer.decodeMessage(bytes).kind === 'other') continue;
    const resized = (length) => {
      const other = new Uint8Array(length);
      other.set(bytes.subarray(0, length));
      new DataView(other.buffer).setUint32(12, length - HEADER, true);
      return other;
    };
    for (let length = HEADER; length < bytes.length; ++length)
      assert.throws(() => viewer.decodeMessage(resized(length)), viewer.ProtocolError, `${name} of ${length} bytes`);
    assert.throws(() => viewer.decodeMessage(resized(bytes.length + 1)), viewer.ProtocolError, `${name} with a byte too many`);
  }
});

/** Message type of the document's example, and its generated codec. */
const codecOf = (name) => {
  const type = name.replace(/_(TOKEN|IMAGES|PLANNED)$/, '').split('_').map((word) => word[0] + word.slice(1).toLowerCase()).join('');
  return {type, read: (bytes) => viewer.wire[`read${type}`](new viewer.ByteReader(bytes)), write: (value) => viewer.encoded(viewer.wire[`write${type}`], value)};
};

test('the generated codec of every message reads it and writes the same bytes again', () => {
  const seen = new Set();
  for (const name of golden.keys()) {
    const {type, read, write} = codecOf(name);
    assert.deepEqual([...write(read(bodyOf(name)))], [...bodyOf(name)], name);
    seen.add(type);
  }
  assert.deepEqual([...seen].sort(), Object.keys(viewer.wire.MessageType).sort());
});

test('a message cut anywhere or with a byte too many is refused by its generated codec', () => {
  for (const name of golden.keys()) {
    const {read} = codecOf(name);
    const body = bodyOf(name);
    for (let length = 0; length < body.length; ++length) assert.throws(() => read(body.slice(0, length)), viewer.ProtocolError, `${name} of ${length} bytes`);
    assert.throws(() => read(Uint8Array.of(...body, 0)), viewer.ProtocolError, `${name} with a byte too many`);
  }
});

test('a section of a later version is skipped in every message that has sections', () => {
  const payload = new TextEncoder().encode('what a later version says');
  let tried = 0;
  for (const [name, {fields, sections = {}}] of Object.entries(schema.messages)) {
    if (!fields.some(({type}) => type === 'sections')) continue;
    const {read, write} = codecOf(name);
    const value = read(bodyOf(name));
    const absent = Object.keys(sections).length ? {...value, sections: Object.fromEntries(Object.keys(value.sections).map((key) => [key, null]))} : value;
    const list = write(absent).length - 4;  // where the list of sections begins, which ends the body
    const body = bodyOf(name);
    const longer = new Uint8Array(body.length + 8 + payload.length);
    const view = new DataView(longer.buffer);
    longer.set(body);
    view.setUint16(list, view.getUint16(list, true) + 1, true);
    view.setUint16(body.length, 999, true);
    view.setUint32(body.length + 4, payload.length, true);
    longer.set(payload, body.length + 8);
    assert.deepEqual(read(longer), value, name);
    ++tried;
  }
  assert.ok(tried >= 11, `${tried} messages`);
});

test('limits of the schema are kept', () => {
  const refused = (name, change) => {
    const {read, write} = codecOf(name);
    const value = read(bodyOf(name));
    change(value);
    assert.throws(() => read(write(value)), viewer.ProtocolError, name);
  };
  refused('IMAGE', (image) => (image.width = 4097));
  refused('IMAGE', (image) => (image.height = 4097));
  refused('PLAN', (plan) => (plan.needles = Array.from({length: 4097}, () => plan.needles[0])));
  refused('FRAME', ({sections}) => (sections.needleShapes.entries[0].points = new Float32Array(3)));
  refused('ERROR', (error) => (error.fatal = 2));  // neither 0 nor 1
  refused('PING', (ping) => (ping.reply = 2));
  refused('FRAME', ({needles}) => (needles[0].present = 2));
});

test('PLAN has the needles in use and where their seeds go, and a request is written as it is read', () => {
  const plan = decode('PLAN');
  assert.deepEqual(plan, {
    kind: 3, optimising: true, change: 2, airKermaStrengthU: 0.5, by: 'desk (127.0.0.1)',
    needles: [{number: 4, begun: true, firstSeed: 12, depthMm: 80.5, hole: 'E7', train: 's-s--s'},
              {number: 9, begun: false, firstSeed: 31, depthMm: 78, hole: 'G5', train: 'ss'}]});
  const seeds = viewer.plannedSeeds(plan, {origin: [-30, -30, -60], spacingMm: 5, columns: 13, rows: 13});
  assert.deepEqual([...seeds.keys()], [12, 13, 14, 31, 32]);
  assert.deepEqual(seeds.get(13).position, [-10, 0, -60 + 80.5 - 12.25]);
  const asked = (needles) => viewer.decodePlan(viewer.encodePlanRequest(2, needles));
  assert.deepEqual([asked(null).kind, asked(null).needles], [2, []]);
  assert.deepEqual([asked(plan.needles).kind, asked(plan.needles).change], [3, 2]);
  const many = Array.from({length: 100}, (_, i) => ({...plan.needles[1], number: i}));  // more than the writer begins with
  assert.deepEqual(asked(many).needles, many);
  assert.deepEqual(asked(plan.needles).needles, plan.needles.map((needle) => ({...needle, begun: false})));
});

test('holes are shown and typed as the scene names them, and sent as messages do', () => {
  const wire = {origin: [-30, -30, -60], spacingMm: 5, columns: 13, rows: 13, fromRight: false, halfSteps: false};
  const clinic = {...wire, fromRight: true, halfSteps: true};
  for (const grid of [wire, {...wire, fromRight: true}, {...wire, halfSteps: true}, clinic])
    for (let column = 0; column < grid.columns; ++column)
      for (let row = 0; row < grid.rows; ++row) {
        const name = viewer.holeName({column, row}, grid);
        assert.deepEqual(viewer.holeOf(name, grid), {column, row}, name);
        assert.equal(viewer.shownHole(viewer.wireHole(name, grid), grid), name);
      }
  // The same as tests/core/brachytherapy/plan/template_grid_test.cpp has.
  assert.deepEqual(viewer.holeOf('D4', {...wire, fromRight: true}), {column: 9, row: 3});
  assert.deepEqual(viewer.holeOf('d4.5', clinic), {column: 5, row: 7});
  assert.equal(viewer.wireHole('d4.5', clinic), 'F8');
  assert.equal(viewer.shownHole('A1', clinic), 'G1');
  for (const name of ['d4', 'D4.5', 'N1', 'A14', 'A0', 'A01']) assert.equal(viewer.holeOf(name, wire), null, name);
  for (const name of ['g7', 'G7.5', 'H1', 'A1.0', 'A0.5']) assert.equal(viewer.holeOf(name, clinic), null, name);
  const plan = viewer.shownPlan(decode('PLAN'), clinic);
  assert.deepEqual(plan.needles.map(({hole}) => hole), ['E4', 'D3']);
});

test('a seed moves along its needle by a spacer where nothing is in the way, and its removal leaves the others', () => {
  assert.deepEqual(viewer.moveSeed('s-s', 0, 1), {train: '-ss', at: 1});
  assert.deepEqual(viewer.moveSeed('s-s', 2, -1), {train: 'ss', at: 1});
  assert.deepEqual(viewer.moveSeed('s-s', 2, 1), {train: 's--s', at: 3});
  assert.deepEqual(viewer.moveSeed('ss', 0, 1), {train: 'ss', at: 0});
  assert.deepEqual(viewer.moveSeed('ss', 0, -1), {train: 'ss', at: 0});
  assert.equal(viewer.removeSeed('s-s-s', 2), 's---s');
  assert.equal(viewer.removeSeed('s-s', 2), 's');
  assert.equal(viewer.removeSeed('s', 0), 's');
});

test('another magic, version or length is refused', () => {
  for (const at of [0, 4, 12]) {
    const bytes = golden.get('EVENT').slice();
    bytes[at] ^= 1;
    assert.throws(() => viewer.decodeMessage(bytes), viewer.ProtocolError);
  }
});

test('WELCOME says who we are and what comes', () => {
  const welcome = decode('WELCOME');
  assert.deepEqual([welcome.session, welcome.role, welcome.deformationHz, welcome.snapshotHz, welcome.needle, welcome.needleCount],
                   [7, 2, 200, 30, 2, 3]);
  assert.equal(welcome.topologyHash, 0x2f2673dd4fb1cdb3n);
  assert.equal(welcome.server, 'brachyd 0.1.0');
  assert.deepEqual(welcome.limits, {maxForceN: 3.5, maxStiffnessNPerMm: 1, dampingNSPerMm: 0.0005, rateHz: 1000, notPlausible: 4});
});

test('TOPOLOGY has points, triangles and a hash that holds', () => {
  const topology = decode('TOPOLOGY');
  assert.deepEqual([topology.surfaceVertexCount, topology.pointCount, topology.triangles.length, topology.name], [4, 5, 12, 'tetrahedron']);
  assert.deepEqual([...topology.restPositions.slice(12)], [2.5, 2.5, 2.5]);
  assert.equal(topology.hashHolds, true);
  const bytes = golden.get('TOPOLOGY').slice();
  bytes[HEADER + 24 + 48] ^= 1;  // the first position
  assert.equal(viewer.decodeMessage(bytes).body.hashHolds, false);
});

test('FRAME has needle, forces, seeds, certificate and lag', () => {
  const frame = decode('FRAME');
  assert.deepEqual([frame.tick, frame.baseTick, frame.snapshotSequence, frame.overruns, frame.full, frame.stepFlags], [42, 40, 9, 3, false, 0xc62]);
  assert.deepEqual([...frame.ranges], [1, 1, 3, 1]);
  assert.deepEqual([...frame.positions], [10, 0.5, -0.25, 0, 0, 9]);
  const [needle] = frame.needles;
  assert.deepEqual([needle.id, needle.contact, needle.present, needle.landmarkCount, needle.insertionDepthMm], [0, 2, true, 11, 12.5]);
  assert.deepEqual([needle.pose[1], needle.pose[3], needle.pose[7], needle.pose[11]], [-1, 1.5, -2, 30.25]);
  assert.deepEqual(needle.forces, {inputSequence: 17, forceN: [0.5, -0.25, 2], tipTorqueNmm: [8, -4, 1], hubTorqueNmm: [-128, 64, 16], axialN: 2, lateralN: 0.5,
                                   cuttingN: 1.25, frictionN: 0.75, tipDepthMm: 14.5});
  assert.deepEqual([needle.shape.tipAxis, needle.shape.tipDeflection], [[0.0625, 0, 0.998046875], [2, 0, 0]]);
  assert.equal(needle.shape.points.length, 3 * 17);
  assert.deepEqual([...needle.shape.points.slice(0, 3), ...needle.shape.points.slice(-3)], [1.5, -2, -169.75, 3.5, -2, 30.25]);
  assert.equal(frame.seeds.count, 2);
  const [seed] = frame.seeds.entries;
  assert.deepEqual([seed.id, seed.planned, seed.needle, seed.certified, seed.tick], [2, 1, 0, true, 40]);
  assert.deepEqual([seed.dropped, seed.rest, seed.position, seed.axis], [[1.5, -2, 28], [1.5, -2, 26.5], [1.5, -2, 27.75], [0, 0, 1]]);
  assert.deepEqual(frame.certificate, {verdict: 'injective', substeps: 3, detBound: 0.25, vertexDet: 0.5, place: [1.5, -2, 28],
                                       marginMm: 0.75, heldMm: 2.125, heldN: NaN, condition: 1024});
  assert.equal(frame.lagMm, 0.375);
});

const LAG_BYTES = 8 + 4;  // the last section of the page's FRAME

test('a FRAME of an earlier daemon tells no lag', () => {
  const bytes = golden.get('FRAME').slice(0, -LAG_BYTES);
  const view = new DataView(bytes.buffer);
  view.setUint32(12, bytes.length - HEADER, true);
  const sections = bytes.findIndex((_, i) => i > HEADER + 120 && view.getUint32(i, true) === 8 && view.getUint32(i + 4, true) === 1);
  view.setUint16(sections, 7, true);
  const frame = viewer.decodeMessage(bytes).body;
  assert.equal(frame.lagMm, null);
  assert.equal(frame.certificate.substeps, 3);
});

test('of late tissue the page says by how much, where that is known and can be seen', () => {
  const late = (lagMm, stepFlags = 1 << 10) => viewer.lateText({stepFlags, lagMm});
  assert.equal(late(0.354), ' · 0.35 mm late');
  assert.equal(late(11), ' · 11.00 mm late');
  for (const lagMm of [null, NaN, 0, 0.004]) assert.equal(late(lagMm), ' · late', `${lagMm}`);
  assert.equal(late(0.009, 0x862), '', 'what is not late');
});

test('a verdict of a later version is read as unknown', () => {
  const bytes = golden.get('FRAME').slice();
  const at = bytes.findLastIndex((_, i) => bytes[i] === 3 && bytes[i + 4] === 80 && bytes[i + 1] === 0 && bytes[i + 5] === 0) + 8;
  assert.equal(bytes[at], 1);
  for (const [verdict, name] of [[0, 'unknown'], [2, 'folded'], [9, 'unknown']]) {
    bytes[at] = verdict;
    assert.equal(viewer.decodeMessage(bytes).body.certificate.verdict, name);
  }
});

test('a shape of a needle that is not there, or without points, is refused', () => {
  const bytes = golden.get('FRAME');
  const at = bytes.length - LAG_BYTES - (8 + 48 + 12 * 17);  // the only shape: needle, number of points
  for (const [offset, value] of [[0, 7], [2, 1], [2, 0], [2, 18]]) {
    const other = bytes.slice();
    other[at + offset] = value;
    assert.throws(() => viewer.decodeMessage(other), viewer.ProtocolError);
  }
});

test('STATE, EVENT, ERROR, PING and FORCE', () => {
  const state = decode('STATE');
  assert.deepEqual([state.ticks, state.overruns, state.posesAccepted, state.snapshotsDropped, state.clients], [1000, 3, 900, 10, 4]);
  assert.deepEqual(state.latencyMs, {count: 900, p50: 2.5, p99: 5, p999: 6, max: 8});
  assert.equal(state.deviceHolder, 'touch (127.0.0.1:5)');
  assert.deepEqual(Object.keys(state.controls), ['kernel', 'supportRadiusMm', 'scriptIsThere', 'scriptPlays', 'scriptLoops', 'preparesModel']);
  assert.equal(state.controls.kernel, 'psi31');
  assert.deepEqual(decode('EVENT'), {kind: 3, needle: 0, tick: 42, text: 'capsule punctured'});
  assert.deepEqual(decode('ERROR'), {code: 7, fatal: false, reason: 3, aboutSequence: 17, text: 'not rigid'});
  assert.deepEqual(decode('PING'), {nonce: 5n, reply: true, echoedStampNs: 0x77359407n, receivedNs: 0x3b9acc4en});
  assert.deepEqual(decode('FORCE'), {needle: 2, flags: 3, validMs: 0, tick: 42, inputSequence: 17, inputStampNs: 1000000500, forces: {
    forceN: [0.5, -0.25, 2], tipTorqueNmm: [8, -4, 1], hubTorqueNmm: [-128, 64, 16], axialN: 2, lateralN: 0.5, cuttingN: 1.25, frictionN: 0.75}});
});

test('DOSE has figures, a histogram and the surface', () => {
  const dose = decode('DOSE');
  assert.deepEqual([dose.seeds, dose.prescriptionGy, dose.airKermaStrengthU], [2, 145, 1]);
  const [prostate] = dose.structures;
  assert.deepEqual([prostate.name, prostate.v100Percent, prostate.d90Gy, prostate.d2ccGy], ['prostate', 0.5, 0.5, NaN]);
  assert.deepEqual([...prostate.volumeShare], [1, 0.5, 0.25]);
  assert.deepEqual([...dose.surfaceGy], [150, NaN]);
  assert.equal(dose.withPlanned, null, 'a daemon that does not send it');
});

/** The page's DOSE with one more section, WITH_PLANNED: the same structure. */
function doseWithPlanned(count = 1) {
  const body = bodyOf('DOSE');
  const structure = body.slice(24, body.length - (4 + 8 + 16));
  const bytes = new Uint8Array(HEADER + body.length + 8 + 8 + structure.length);
  const view = new DataView(bytes.buffer);
  bytes.set(golden.get('DOSE'));
  bytes.set(structure, bytes.length - structure.length);
  view.setUint32(12, bytes.length - HEADER, true);
  view.setUint16(HEADER + 24 + structure.length, 2, true);  // sections
  view.setUint16(HEADER + body.length, 2, true);            // WITH_PLANNED
  view.setUint32(HEADER + body.length + 4, 8 + structure.length, true);
  view.setUint16(HEADER + body.length + 8, count, true);
  view.setFloat64(bytes.length - structure.length + 10 + 8 * 8, 140, true);  // D90
  return bytes;
}

test('DOSE may say what comes with the planned rest', () => {
  const dose = viewer.decodeMessage(doseWithPlanned()).body;
  assert.deepEqual([dose.structures[0].d90Gy, dose.withPlanned.length], [0.5, 1]);
  assert.deepEqual([dose.withPlanned[0].name, dose.withPlanned[0].d90Gy, [...dose.withPlanned[0].volumeShare]], ['prostate', 140, [1, 0.5, 0.25]]);
  assert.deepEqual([...dose.surfaceGy], [150, NaN]);
  for (const count of [0, 2, 65535]) assert.throws(() => viewer.decodeMessage(doseWithPlanned(count)), viewer.ProtocolError, `${count} structures`);
});

test('SCENE has template, plan, structures and kernels', () => {
  const scene = decode('SCENE');
  assert.deepEqual([scene.needleLengthMm, scene.needleDiameterMm, scene.seedLengthMm, scene.prescriptionGy], [200, 1.25, 4.5, 145]);
  assert.deepEqual(scene.template, {origin: [-30, -30, -60], spacingMm: 5, columns: 13, rows: 12, fromRight: true, halfSteps: true});
  assert.deepEqual(scene.plannedNeedles, [{tip: [5, -10, 20.5], hole: 'G5'}]);
  assert.deepEqual(scene.plannedSeeds, [{position: [5, -10, 18.25], axis: [0, 0, 1], needle: 0}]);
  assert.deepEqual(scene.structures.map((structure) => structure.name), ['urethra']);
  assert.ok(scene.kernels.length > 0);
  assert.deepEqual(scene.goals, [{structure: 'prostate', figure: 'D90', limit: 130.5, above: true, ofPlan: false, source: 'ABS'}]);
  assert.deepEqual([...scene.colours], [['urethra', '#f2c94c']]);
});

test('IMAGE has its pixels in their place, SCANNER what is set', () => {
  const image = decode('IMAGE');
  assert.deepEqual([image.array, image.held, image.frozen, image.width, image.height, image.sequence, image.tick, image.newestTick],
                   [viewer.ScannerArray.Sagittal, true, false, 3, 2, 7, 40, 42]);
  assert.deepEqual([...image.pixels], [0, 64, 128, 192, 255, 1]);
  assert.deepEqual(viewer.toWorld(image, {x: 2, y: 1}), [1.5, 60.25, -2.75]);
  const back = viewer.toPixel(image, [1.5, 60.25, -2.75]);
  assert.deepEqual([back.x, back.y, Math.abs(back.aside)], [2, 1, 0]);
  const scanner = decode('SCANNER');
  assert.deepEqual([scanner.array, scanner.frozen, scanner.probeIsStepped, scanner.probeHasDevice, scanner.tick, scanner.gainDb, scanner.probeRotationDeg],
                   [viewer.ScannerArray.Biplane, false, true, false, 42, -3, 15]);
  const bytes = golden.get('IMAGE').slice();
  bytes[HEADER + 4] = 4;  // wider than its pixels
  assert.throws(() => viewer.decodeMessage(bytes), viewer.ProtocolError);
});

test('a request to the scanner leaves alone what it does not name', () => {
  const body = Buffer.from(viewer.encodeScanner({gainDb: -3, frozen: false}));
  assert.deepEqual([body.length, body.readUInt16LE(0), body.readUInt16LE(2), body.readDoubleLE(24)], [76, 0, 1, -3]);
  for (const at of [16, 32, 40, 48, 56, 64]) assert.ok(Number.isNaN(body.readDoubleLE(at)), `offset ${at}`);
  const whole = viewer.decodeMessage(golden.get('SCANNER')).body;
  const again = Buffer.from(viewer.encodeScanner(whole));
  assert.deepEqual([...again.subarray(16)], [...bodyOf('SCANNER').subarray(16)]);
});

test('holes of the template are points across the needles and rows along them', () => {
  const template = {origin: [-30, 0, -60], spacingMm: 5, columns: 13, rows: 13};
  const across = {width: 512, height: 512, spacingMm: 0.2, pose: [-1, 0, 0, 50, 0, -1, 0, 80, 0, 0, 1, 12]};
  const points = viewer.templateMarks(across, template);
  assert.equal(points.length, 169);
  const hole = points.find((mark) => mark.column === 2 && mark.row === 3);  // C4, at x -20, y 15
  assert.equal(hole.kind, 'point');
  assert.ok(Math.abs(hole.at.x - 70 / 0.2) < 1e-9 && Math.abs(hole.at.y - 65 / 0.2) < 1e-9);
  // In the plane x = 1: of columns 5 mm apart only x = 0 is within 2.5 mm.
  const along = {width: 512, height: 512, spacingMm: 0.2, pose: [0, 0, 1, 1, 0, -1, 0, 80, -1, 0, 0, 50]};
  const rows = viewer.templateMarks(along, template);
  assert.deepEqual([rows.length, rows.every((mark) => mark.kind === 'line' && mark.column === 6)], [13, true]);
  assert.ok(Math.abs(rows[3].from.y - 65 / 0.2) < 1e-6 && Math.abs(rows[3].to.y - 65 / 0.2) < 1e-6);
});

test('what the viewer says has the bytes of the page', () => {
  const pose = new Float64Array(bodyOf('POSE').slice(8).buffer);
  assert.deepEqual(viewer.encodePose(2, pose), bodyOf('POSE'));
  assert.deepEqual(viewer.encodeDrop(2, true), bodyOf('DROP'));
  assert.deepEqual(viewer.encodePing(5n, {echoedStampNs: 0x77359407n, receivedNs: 0x3b9acc4en}), bodyOf('PING'));
  const model = bodyOf('CONTROL');
  model[2] = 0;  // the page's example has the flag of PLAY, too
  assert.deepEqual(viewer.encodeControl({action: 'model', kernel: 'psi32', supportRadiusMm: 18.5}), model);
  assert.deepEqual([...viewer.encodeControl({action: 'play', loop: true}).slice(0, 4)], [1, 0, 1, 0]);

  const hello = bodyOf('HELLO');
  const view = new DataView(hello.buffer);
  view.setFloat64(8, NaN, true);  // a mouse states no force, no stiffness,
  view.setFloat64(16, NaN, true);
  hello[hello.length - 6] = 0;    // and does not work out a force itself
  assert.deepEqual(viewer.encodeHello({role: 2, subscription: 2, name: 'touch', device: {needle: 2, rateHz: 1000}, token: null}), hello);
  const token = Uint8Array.from({length: 32}, (_, i) => 0xe0 + i);
  assert.deepEqual(viewer.encodeHello({role: 3, subscription: 0, name: 'desk', device: null, token, software: 'desk 2.1'}), bodyOf('HELLO_TOKEN'));

  const plain = viewer.encodeHello({role: 1, subscription: 16, name: 'test', device: null});  // what is not stated is absent
  assert.deepEqual([...plain.slice(0, 8), ...plain.slice(40)], [1, 0, 0, 0, 16, 0, 0, 0, 4, 0, ...Buffer.from('test'), 0, 0, 0, 0]);

  const header = viewer.encodeMessage(13, 20, 0x3b9acd20n, viewer.encodeDrop(2, true));
  assert.deepEqual(header, golden.get('DROP'));
});

const FULL = {base: 0, full: true, ranges: [0, 5], positions: Float32Array.from({length: 15}, (_, i) => i), seeds: null};
const frame = (tick, some = {}) => {
  const fields = {base: tick - 1, full: false, ranges: [], positions: [], seeds: null, points: 5, ...some};
  return {topologyHash: 0x2f2673dd4fb1cdb3n, tick, baseTick: fields.base, full: fields.full, pointCount: fields.points,
          ranges: Uint32Array.from(fields.ranges), positions: Float32Array.from(fields.positions), seeds: fields.seeds};
};
const assembled = () => {
  const mesh = new viewer.FrameAssembler();
  assert.equal(mesh.start(decode('TOPOLOGY')), '');
  return mesh;
};

test('a mesh takes a full frame and then changes', () => {
  const mesh = assembled();
  assert.equal(mesh.apply(frame(4, FULL)), '');
  assert.equal(mesh.apply(frame(6, {base: 4, ranges: [1, 1], positions: [7, 8, 9]})), '');
  assert.deepEqual([...mesh.positions.slice(0, 9)], [0, 1, 2, 7, 8, 9, 6, 7, 8]);
  assert.equal(mesh.tick, 6);
});

test('frames that do not fit are refused and change nothing', () => {
  assert.match(new viewer.FrameAssembler().apply(frame(1, FULL)), /before the topology/);
  assert.match(assembled().start({...decode('TOPOLOGY'), hashHolds: false}), /hash/);
  const mesh = assembled();
  assert.match(mesh.apply(frame(2)), /not a full one/);
  assert.equal(mesh.apply(frame(4, FULL)), '');
  const before = [...mesh.positions];
  assert.match(mesh.apply({...frame(5), topologyHash: 1n}), /another topology/);
  assert.match(mesh.apply(frame(5, {points: 4})), /number of points/);
  assert.match(mesh.apply(frame(9, {base: 8, ranges: [0, 1], positions: [1, 1, 1]})), /later than this mesh/);
  assert.match(mesh.apply(frame(3, {base: 2, ranges: [0, 1], positions: [1, 1, 1]})), /older/);
  assert.match(mesh.apply(frame(5, {seeds: {count: 2, entries: [{id: 2}]}})), /lacks seeds/);
  assert.deepEqual([...mesh.positions], before);
});

test('seeds are kept, moved and, by a full frame after a reset, forgotten', () => {
  const mesh = assembled();
  mesh.apply(frame(4, {...FULL, seeds: {count: 1, entries: [{id: 1, place: 'a'}]}}));
  assert.equal(mesh.apply(frame(5, {seeds: {count: 2, entries: [{id: 1, place: 'b'}, {id: 2, place: 'c'}]}})), '');
  assert.deepEqual(mesh.seeds.map((seed) => seed.place), ['b', 'c']);
  assert.match(mesh.apply(frame(6)), /lacks seeds/);
  assert.equal(mesh.apply(frame(1, FULL)), '');
  assert.deepEqual(mesh.seeds, []);
});
