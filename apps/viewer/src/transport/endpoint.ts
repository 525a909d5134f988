// Address of the daemon that served this page, and the token for it.

const KEPT = 'brachy-token';
const ASK_AGAIN_MS = 300;

const token = (digits: string): Uint8Array | null =>
  /^[0-9a-f]{64}$/i.test(digits) ? Uint8Array.from(digits.match(/../g)!, (byte) => parseInt(byte, 16)) : null;

export class Endpoint {
  readonly url: string;
  /** null: no token. */
  token: Uint8Array | null = null;

  constructor(served: boolean) {
    this.url = served ? `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/ws` : 'ws://localhost/ws';
    if (served && !this.takeToken()) this.token = token(sessionStorage.getItem(KEPT) ?? '');
  }

  /** The headers of a request over HTTP. */
  authorisation(): Record<string, string> {
    const digits = this.token && Array.from(this.token, (byte) => byte.toString(16).padStart(2, '0')).join('');
    return digits ? {Authorization: `Bearer ${digits}`} : {};
  }

  /** A page of the daemon for whom the token is; asks again while the daemon reads (202). `null`: the daemon does not answer. */
  async get(page: string): Promise<Response | null> {
    try {
      for (;;) {
        const answer = await fetch(`/${page}`, {cache: 'no-store', headers: this.authorisation()});
        if (answer.status !== 202) return answer;
        await new Promise((resolve) => setTimeout(resolve, ASK_AGAIN_MS));
      }
    } catch {
      return null;
    }
  }

  /** Moves #token=… from the page's visible address into this tab's storage. False: there is none. */
  takeToken(): boolean {
    const hash = new URLSearchParams(location.hash.slice(1));
    const given = hash.get('token');
    if (given === null) return false;
    hash.delete('token');
    history.replaceState(null, '', location.pathname + location.search + (hash.size > 0 ? `#${hash}` : ''));
    this.token = token(given);
    sessionStorage.setItem(KEPT, given);
    return true;
  }
}
