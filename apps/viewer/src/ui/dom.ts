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

export function element(tag: string, text: string, className = ''): HTMLElement {
  const made = document.createElement(tag);
  made.textContent = text;
  made.className = className;
  return made;
}

function withUrl(content: BlobPart, type: string, use: (url: string) => void): void {
  const url = URL.createObjectURL(new Blob([content], {type}));
  use(url);
  setTimeout(() => URL.revokeObjectURL(url), 60_000);
}

/** Opens a page in a tab of its own, by its content: a link would not carry the token. */
export function openPage(html: string): void {
  withUrl(html, 'text/html', (url) => window.open(url, '_blank'));
}

/** Has the browser store a file. */
export function download(name: string, content: BlobPart, type: string): void {
  withUrl(content, type, (url) => {
    const link = document.createElement('a');
    link.href = url;
    link.download = name;
    link.click();
  });
}
