/**
 * Plays an audio file in sync with the pictures.
 *
 * The pictures set the time. After each of them, the audio is started, stopped or moved if necessary; while it is at most
 * TOLERANCE_S away from the picture, it is left alone, because moving it is audible. If no more pictures come, it waits.
 */

const TOLERANCE_S = 0.1;
const JUMP_S = 1; // a larger difference comes from a seek or a loop, not from a slow browser
const [MIN_SPEED, MAX_SPEED] = [1 / 16, 16]; // browsers are silent at other speeds
const GESTURES = ["click", "keydown", "touchend"]; // after which browsers allow sound

/** `blocked`: the browser allows sound only after the next click or key. */
export type AudioState = "none" | "ready" | "blocked" | "failed";

/** The picture on the screen. */
export interface ShownPicture {
  /** Time of the picture, seconds from frame 0. */
  readonly seconds: number;
  readonly durationSeconds: number;
  readonly speed: number;
  readonly isPlaying: boolean;
}

export class Sound {
  /** The audio element, which is in no document. */
  readonly element = new Audio();
  readonly #onChange: (failure: string | null) => void;
  readonly #abortController = new AbortController();
  #url: string | null = null;
  #blobUrl: string | null = null;
  #state: AudioState = "none";
  #picture: ShownPicture | null = null;
  #lead = 0; // seconds that the audio is moved ahead of the picture, because moving it takes time
  #timer = 0;

  /** Time in the audio file of frame 0, seconds. */
  start = 0;

  /**
   * Create a sound without audio. `onChange` is called when the state, `muted` or `volume` has changed, with the reason if
   * the file cannot be played.
   */
  constructor(onChange: (failure: string | null) => void) {
    this.#onChange = onChange;
    const { element } = this;
    const { signal } = this.#abortController;
    element.addEventListener("loadedmetadata", () => this.#requireSeekable(), { signal });
    element.addEventListener("error", () => this.#fail(element.error?.message), { signal });
    element.addEventListener("volumechange", () => onChange(null), { signal });
    for (const type of GESTURES) window.addEventListener(type, () => this.#unblock(), { signal });
  }

  get state(): AudioState {
    return this.#state;
  }

  get url(): string | null {
    return this.#url;
  }

  set url(url: string | null) {
    this.#release();
    this.#url = url;
    this.#state = url === null ? "none" : "ready";
    if (url !== null) this.element.src = url;
    this.#onChange(null);
  }

  /** Follow a picture that has just been shown, or whose playback has just been started or stopped. */
  follow(picture: ShownPicture): void {
    this.#picture = picture;
    this.#update();
  }

  dispose(): void {
    this.#abortController.abort();
    this.#url = null;
    this.#release();
  }

  #update(): void {
    clearTimeout(this.#timer);
    if (this.#picture === null || this.#state !== "ready") return;
    const { element } = this;
    const { seconds, durationSeconds, speed, isPlaying } = this.#picture;
    const target = this.start + seconds;
    const isInside = target >= 0 && !(target >= element.duration); // the duration is NaN until it is known
    const isAudible = isPlaying && isInside && speed >= MIN_SPEED && speed <= MAX_SPEED;
    if (!isAudible) element.pause();
    if (isInside) this.#moveTo(target, speed);
    if (!isAudible) return;
    element.playbackRate = speed;
    if (element.paused && !element.ended) this.#play();
    this.#timer = window.setTimeout(() => element.pause(), 1000 * (durationSeconds / speed + TOLERANCE_S));
  }

  #moveTo(target: number, speed: number): void {
    const { element } = this;
    const difference = element.currentTime - target;
    const distance = Math.abs(difference);
    const isRunning = !element.paused || element.ended;
    if (isRunning) {
      if (element.seeking || distance <= TOLERANCE_S * Math.max(1, speed)) return;
      if (distance < JUMP_S) this.#lead = Math.min(JUMP_S, Math.max(0, this.#lead - difference));
    } else if (distance < TOLERANCE_S / 10) return;
    element.currentTime = target + (isRunning ? this.#lead : 0);
  }

  #play(): void {
    this.element.play().catch(({ name }: DOMException) => {
      // Other errors come from a pause, or from a file that has failed, which is an event.
      if (name !== "NotAllowedError" || this.#state !== "ready") return;
      this.#state = "blocked";
      this.#onChange(null);
    });
  }

  #unblock(): void {
    if (this.#state !== "blocked") return;
    this.#state = "ready";
    this.#onChange(null);
    this.#update();
  }

  /** Download the whole file if the server does not answer range requests, without which browsers cannot seek. */
  #requireSeekable(): void {
    const { seekable, duration } = this.element;
    const end = seekable.length === 0 ? 0 : seekable.end(seekable.length - 1);
    const url = this.#url;
    if (url !== null && this.#blobUrl === null && end < duration - TOLERANCE_S) void this.#download(url);
  }

  async #download(url: string): Promise<void> {
    try {
      const blob = await (await fetch(url)).blob();
      if (url === this.#url) this.element.src = this.#blobUrl = URL.createObjectURL(blob);
    } catch (error) {
      if (url === this.#url) this.#fail(String(error));
    }
  }

  #fail(reason = ""): void {
    if (this.#state === "failed") return;
    this.#release();
    this.#state = "failed";
    this.#onChange(`the audio file ${this.#url ?? ""} cannot be played: ${reason}`);
  }

  /** Stop, and forget the file. */
  #release(): void {
    clearTimeout(this.#timer);
    this.element.pause();
    this.element.removeAttribute("src");
    this.element.load(); // ends the download
    if (this.#blobUrl !== null) URL.revokeObjectURL(this.#blobUrl);
    this.#blobUrl = null;
  }
}
