// The page as a layout for each of three people: the trainee at the ultrasound, the teacher at the result, the researcher at the charts.
import {byId, setText} from './dom.js';

export const PEOPLE = ['trainee', 'teacher', 'research'] as const;
export type Person = (typeof PEOPLE)[number];

const isPerson = (text: string | null): text is Person => PEOPLE.some((person) => person === text);

export class Roles {
  person: Person = 'research';
  /** Without the 3-D view, and without the plan over the images. */
  isExamination = false;

  /** Begins as the page's address says, ?as=trainee and &exam. `onChange`: the layout is another. */
  constructor(private readonly onChange: () => void) {
    for (const button of byId('as').querySelectorAll('button'))
      button.addEventListener('click', () => this.set(button.dataset['as'] as Person, this.isExamination));
    byId<HTMLInputElement>('exam').addEventListener('change', (event) => this.set(this.person, (event.target as HTMLInputElement).checked));
  }

  start(): void {
    const query = new URLSearchParams(location.search);
    const asked = query.get('as');
    this.set(isPerson(asked) ? asked : 'research', query.has('exam'));
  }

  private set(person: Person, isExamination: boolean): void {
    this.person = person;
    this.isExamination = isExamination && person === 'trainee';
    document.body.dataset['as'] = person;
    document.body.classList.toggle('exam', this.isExamination);
    for (const button of byId('as').querySelectorAll('button')) button.setAttribute('aria-pressed', String(button.dataset['as'] === person));
    setText(byId('toggle-left'), person === 'trainee' ? 'Exercise' : 'Controls');
    setText(byId('toggle-right'), person === 'teacher' ? 'Debrief' : 'Charts');
    byId('tab-debrief').hidden = person !== 'teacher';
    byId('exam-row').hidden = person !== 'trainee';
    byId<HTMLInputElement>('exam').checked = this.isExamination;
    // The trainee has the exercise beside the images, and not in a tab behind them.
    const host = person === 'trainee' ? byId('task') : byId('right');
    if (byId('panel-exercise').parentElement !== host) host.append(byId('panel-exercise'));
    const query = new URLSearchParams(location.search);
    query.set('as', person);
    if (this.isExamination) query.set('exam', '1');
    else query.delete('exam');
    if (person !== 'research' || location.search !== '') history.replaceState(null, '', `${location.pathname}?${query}${location.hash}`);
    this.onChange();
  }
}
