// The daemon's reports in a trainee's words: each text that its sources can say has some, without a term of the researcher.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {test} from 'node:test';
import {viewer} from './viewer_module.mjs';

const source = (path) => readFileSync(new URL(`../../${path}`, import.meta.url), 'utf8');
const TERMS = /injectiv|sub-step|landmark|field|det J|pose|20 Hz|\barm\b|clamp|solved|slew|stiffness|stick and slip|max_force|local model/i;

/** String literals of C++, neighbours joined, `{}` filled in. */
const literals = (text) => [...text.replace(/"\s*\n\s*"/g, '').matchAll(/"((?:[^"\\]|\\.)*)"/g)].map(([, said]) => said.replace(/\{[^}]*\}/g, '2.5'));

test("the guard's warnings say what to do", () => {
  const text = source('apps/daemon/telemetry/guard_events.cpp');
  const said = literals(text.slice(text.indexOf('std::string actions_of'))).filter((each) => /[a-z]{4}/.test(each) && !/^\s*\(.*not reported|\.h$/.test(each));
  assert.ok(said.length >= 9, said.join('\n'));
  for (const each of said) {
    if (each === ' (2.5 N)') continue;
    const words = viewer.inPlainWords(each);
    assert.ok(!TERMS.test(words), `${each} → ${words}`);
    assert.notEqual(words.toLowerCase(), each.toLowerCase());
  }
  assert.equal(viewer.inPlainWords('field folds at (1.0, -2.0, 3.5) mm, sub-steps: 3, landmarks clamped 2.1 mm (0.40 N) (4 changes before it not reported)'),
               'The tissue would fold here: go slower, or back. The tissue is close to folding: go slower. The tissue cannot follow the needle here: go slower, or back.');
});

test("the force's interventions are said without terms", () => {
  const text = source('haptics/force/force_gate.cpp');
  const said = literals(text.slice(text.indexOf('to_string'), text.indexOf('unknown intervention'))).filter((each) => each.length > 12);
  assert.equal(said.length, 6, said.join('\n'));
  for (const each of said) {
    const words = viewer.inPlainWords(each);
    assert.ok(!TERMS.test(words), `${each} → ${words}`);
    assert.equal(viewer.inPlainWords(`needle 1: ${each}`), words, 'of several needles, too');
  }
});

test('contact, seeds and devices are whole sentences', () => {
  for (const state of literals(source('core/needle/contact_state.h')).filter((each) => /^(free|touching|inserted|through|withdrawn)$/.test(each)))
    assert.match(viewer.inPlainWords(state), /^The .*\.$/);
  assert.equal(viewer.inPlainWords('seed 3 dropped, at rest at (1.0, 2.0, 3.0) mm, 1.4 mm from where the plan has it'), 'Seed 3 dropped, 1.4 mm from its place in the plan.');
  assert.equal(viewer.inPlainWords('seed 3 dropped, at rest at (1.0, 2.0, 3.0) mm'), 'Seed 3 dropped.');
  assert.equal(viewer.inPlainWords('device viewer, by hand (127.0.0.1:4000) attached'), 'Viewer, by hand takes the instrument.');
  assert.equal(viewer.inPlainWords('the needle entered the urethra'), 'The needle entered the urethra');
});

test('the verdict has words, and its terms behind the switch', () => {
  const certificate = (more) => ({verdict: 'injective', substeps: 0, heldMm: 0, ...more});
  assert.deepEqual(viewer.verdictOf(certificate({})), {terms: 'injective', words: 'tissue follows', state: 'good'});
  assert.equal(viewer.verdictOf(certificate({substeps: 2})).words, 'close to folding: go slower');
  assert.deepEqual(viewer.verdictOf(certificate({heldMm: 1.25})), {terms: 'injective · clamped by 1.3 mm', words: 'too fast for the tissue: go slower', state: 'warm'});
  assert.equal(viewer.verdictOf(certificate({verdict: 'folded'})).state, 'bad');
});
