// Operator controls of the simulation: script, reset, model and support radius.
import type {Session} from '../model/session.js';
import type {LiveConnection} from '../transport/live.js';
import {byId, setDisabled, setText} from './dom.js';

const SETTLE_MS = 300;  // no request while a slider is being moved

export class SimulationPanel {
  private loop = true;
  private settle: ReturnType<typeof setTimeout> | undefined;
  private kernels = '';
  /** Requested support radius, not confirmed yet; NaN: none. */
  private asked = NaN;

  constructor(private readonly live: LiveConnection, private readonly session: Session, private readonly isRecorded: () => boolean) {
    byId('play').addEventListener('click', () => this.togglePlay());
    byId('loop').addEventListener('click', () => this.toggleLoop());
    byId('reset').addEventListener('click', () => this.askReset());
    byId<HTMLSelectElement>('kernel').addEventListener('change', (event) =>
      live.control({action: 'model', kernel: (event.target as HTMLSelectElement).value, supportRadiusMm: NaN}));
    byId<HTMLInputElement>('support').addEventListener('input', (event) => {
      this.asked = Number((event.target as HTMLInputElement).value);
      this.update();
      clearTimeout(this.settle);
      this.settle = setTimeout(() => live.control({action: 'model', kernel: '', supportRadiusMm: this.asked}), SETTLE_MS);
    });
    byId<HTMLInputElement>('support').addEventListener('change', () => setTimeout(() => (this.asked = NaN), 2000));
    byId<HTMLDialogElement>('confirm').addEventListener('close', () => {
      if (byId<HTMLDialogElement>('confirm').returnValue === 'yes') live.control({action: 'reset'});
    });
  }

  get plays(): boolean {
    return this.session.state?.controls?.scriptPlays ?? false;
  }

  togglePlay(): void {
    if (byId<HTMLButtonElement>('play').disabled) return;
    this.live.control(this.plays ? {action: 'stop'} : {action: 'play', loop: this.loop});
  }

  toggleLoop(): void {
    this.loop = !this.loop;
    byId('loop').setAttribute('aria-pressed', String(this.loop));
    if (this.plays) this.live.control({action: 'play', loop: this.loop});
  }

  askReset(): void {
    if (byId<HTMLButtonElement>('reset').disabled) return;
    const seeds = this.session.assembler.seeds.length;
    setText(byId('confirm-text'), `The simulation restarts for all clients: tissue, needles and seeds are reset${seeds ? `: ${seeds} seed${seeds > 1 ? 's' : ''} will be removed` : ''}.`);
    const dialog = byId<HTMLDialogElement>('confirm');
    dialog.returnValue = 'no';
    dialog.showModal();
  }

  update(): void {
    const may = this.live.mayControl;
    const controls = this.session.state?.controls ?? null;
    setText(byId('role-note'), may ? '' : this.live.status.phase === 'open' ? '· only an operator can change it' : '');
    setDisabled('play', !may || !controls?.scriptIsThere);
    setDisabled('loop', !may || !controls?.scriptIsThere);
    const recorded = this.isRecorded();
    setDisabled('reset', !may || !controls || recorded || controls.preparesModel);
    byId('reset').title = recorded ? 'A session is being recorded: it cannot be taken back. End it, and start the next one'
      : 'Restart with tissue, needles and seeds reset (R)';
    setText(byId('play'), this.plays ? '■ Stop' : '▶ Start');
    byId('play').title = controls && !controls.scriptIsThere ? 'The scene has no scripted needle: [device] trajectory' : 'Start or stop the scripted needle (Space)';

    const kernels = this.session.scene?.kernels ?? [];
    const select = byId<HTMLSelectElement>('kernel');
    const listed = controls && !kernels.includes(controls.kernel) ? [controls.kernel, ...kernels] : kernels;
    if (this.kernels !== listed.join()) {
      this.kernels = listed.join();
      select.replaceChildren(...listed.map((kernel) => new Option(kernel, kernel)));
    }
    setDisabled('kernel', !may || !controls || kernels.length === 0 || recorded);
    if (controls && document.activeElement !== select) select.value = controls.kernel;

    const support = byId<HTMLInputElement>('support');
    const usesSupport = controls !== null && /^(psi|buhmann)/.test(controls.kernel);
    setDisabled('support', !may || !usesSupport || recorded);
    const radius = Number.isNaN(this.asked) ? controls?.supportRadiusMm ?? NaN : this.asked;
    if (Number.isNaN(this.asked) && Number.isFinite(radius)) support.value = String(radius);
    setText(byId('support-value'), usesSupport && Number.isFinite(radius) ? `${radius.toFixed(1)} mm` : '—');
    setText(byId('model-note'), recorded && may ? 'A session is being recorded: no reset, no other model.' : controls?.preparesModel ? 'A model is being prepared; the current one stays active until then.' : '');
  }
}
