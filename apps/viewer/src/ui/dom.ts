// Access to the elements of index.html.

export function byId<T extends HTMLElement = HTMLElement>(id: string): T {
  const element = document.getElementById(id);
  if (!element) throw new Error(`the page has no #${id}`);
  return element as T;
}

/** Writes only changed text, so that a screen reader does not repeat it. */
export function setText(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

export function setDisabled(id: string, disabled: boolean): void {
  const element = byId<HTMLButtonElement>(id);
  if (element.disabled !== disabled) element.disabled = disabled;
}

/** Shows a message for a few seconds. */
export function toast(text: string, bad = false): void {
  const line = document.createElement('p');
  line.textContent = text;
  line.classList.toggle('bad', bad);
  const host = byId('toasts');
  host.append(line);
  while (host.children.length > 4) host.firstElementChild!.remove();
  setTimeout(() => line.remove(), bad ? 7000 : 4000);
}

/** A number with digits that fit its size, "—" where there is none. */
export function figure(value: number | undefined, digits = 1): string {
  return value === undefined || !Number.isFinite(value) ? '—' : value.toFixed(digits);
}
