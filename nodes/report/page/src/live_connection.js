// The connection to the program that serves the page. It comes back by itself: after a restart of the program, and when a tab wakes.

/** The program says something once a second. After this long without a word the connection is taken to be dead. */
const LONGEST_SILENCE_MS = 8_000;
/** From one try to the next, doubled each time. */
const FIRST_RETRY_MS = 400;
const LAST_RETRY_MS = 5_000;
/** A page that nobody sees says so after this long: then nothing is made for it. */
const HIDDEN_MS = 30_000;

export class Connection {
  /**
   * `take` shows a message of bytes and resolves when it has; `opened` is called before the first message of a connection; `tell` gets
   * the state: "connecting", "connected", "lost", "resting".
   */
  constructor({ take, opened, tell }) {
    Object.assign(this, { take, opened, tell, socket: null, retry_ms: FIRST_RETRY_MS, commands: new Map(), number: 0, timers: {} });
    document.addEventListener("visibilitychange", () => this.visibilityChanged());
    addEventListener("online", () => this.wake());
    this.connect();
  }

  connect() {
    // ws: for http:, wss: for https:
    const scheme = location.protocol.replace("http", "ws");
    const socket = new WebSocket(`${scheme}//${location.host}/live${location.search}`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    // Messages are shown one after the other, and none of a connection that has ended.
    let shown = Promise.resolve();
    socket.addEventListener("open", () => {
      this.retry_ms = FIRST_RETRY_MS;
      this.opened();
      this.tell("connected");
      this.heard();
    });
    socket.addEventListener("message", ({ data }) => {
      if (socket !== this.socket) return;
      this.heard();
      if (typeof data === "string") return this.answered(JSON.parse(data));
      shown = shown.then(async () => {
        if (socket !== this.socket) return;
        await this.take(new Uint8Array(data));
        if (socket.readyState === WebSocket.OPEN) socket.send("shown");
      });
    });
    socket.addEventListener("close", () => socket === this.socket && this.lost());
  }

  heard() {
    clearTimeout(this.timers.silence);
    this.timers.silence = setTimeout(() => this.lost(), LONGEST_SILENCE_MS);
  }

  lost() {
    this.end("lost");
    if (document.hidden) return this.tell("resting");
    this.timers.retry = setTimeout(() => this.connect(), this.retry_ms);
    this.retry_ms = Math.min(LAST_RETRY_MS, 2 * this.retry_ms);
  }

  end(state) {
    for (const timer of Object.values(this.timers)) clearTimeout(timer);
    const { socket } = this;
    this.socket = null;
    socket?.close();
    for (const { reject } of this.commands.values()) reject(new Error("the connection was lost"));
    this.commands.clear();
    this.tell(state);
  }

  /** Connects at once if there is no connection. */
  wake() {
    if (this.socket || document.hidden) return;
    clearTimeout(this.timers.retry);
    this.tell("connecting");
    this.connect();
  }

  visibilityChanged() {
    clearTimeout(this.timers.hidden);
    if (document.hidden) this.timers.hidden = setTimeout(() => this.end("resting"), HIDDEN_MS);
    else this.wake();
  }

  /** Sends a command; resolves with what was done. */
  ask(command) {
    return new Promise((resolve, reject) => {
      if (this.socket?.readyState !== WebSocket.OPEN) return reject(new Error("there is no connection"));
      this.number += 1;
      this.commands.set(this.number, { resolve, reject });
      this.socket.send(JSON.stringify({ ...command, id: this.number }));
    });
  }

  /** Says something that has no answer, if there is a connection. */
  say(text) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(text);
  }

  answered({ id, done, failed }) {
    const waiting = this.commands.get(id);
    this.commands.delete(id);
    if (failed !== undefined) waiting?.reject(new Error(failed));
    else waiting?.resolve(done);
  }
}
