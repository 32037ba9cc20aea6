/** How the audio follows the pictures, with an audio element whose time the test sets. */

import assert from "node:assert/strict";
import { afterEach, test } from "node:test";
import { Sound, type ShownPicture } from "../src/sound.js";

class FakeAudio extends EventTarget {
  static playError: string | null = null;
  static last: FakeAudio;
  moves: number[] = [];
  paused = true;
  ended = false;
  seeking = false;
  muted = false;
  volume = 1;
  playbackRate = 1;
  duration = 10;
  src = "";
  error = { message: "of the file" };
  seekable = { length: 1, end: (): number => this.duration };
  #time = 0;

  constructor() {
    super();
    FakeAudio.last = this;
  }

  get currentTime(): number {
    return this.#time;
  }

  set currentTime(time: number) {
    this.moves.push(time);
    this.#time = time;
    this.ended = false;
  }

  /** Let the audio play on to a time. */
  runTo(time: number): void {
    this.#time = time;
  }

  async play(): Promise<void> {
    if (FakeAudio.playError !== null) throw Object.assign(new Error(), { name: FakeAudio.playError });
    this.paused = false;
  }

  pause(): void {
    this.paused = true;
  }

  load(): void {}
  removeAttribute(): void {}
}

Object.assign(globalThis, { Audio: FakeAudio, window: Object.assign(new EventTarget(), { setTimeout, clearTimeout }) });

const sounds: Sound[] = [];

function makeSound(start = 0): { sound: Sound; audio: FakeAudio; show: (seconds: number, more?: Partial<ShownPicture>) => void; log: string[] } {
  const log: string[] = [];
  const sound = new Sound((failure) => log.push(failure ?? sound.state));
  sounds.push(sound);
  sound.start = start;
  sound.url = "a.wav";
  const show = (seconds: number, more: Partial<ShownPicture> = {}): void =>
    sound.follow({ seconds, durationSeconds: 100, speed: 1, isPlaying: true, ...more });
  return { sound, audio: FakeAudio.last, show, log };
}

afterEach(() => {
  for (const sound of sounds.splice(0)) sound.dispose();
  FakeAudio.playError = null;
});

test("audio starts at the time of the picture, and is moved only if it is more than 0.1 s away", () => {
  const { audio, show } = makeSound(2);
  show(1);
  assert.deepEqual([audio.paused, audio.moves], [false, [3]]);
  for (const [seconds, time] of [[2, 4.09], [3, 4.91]] as const) {
    audio.runTo(time);
    show(seconds);
  }
  assert.deepEqual(audio.moves, [3]);
  audio.runTo(6.2);
  show(4);
  assert.deepEqual(audio.moves, [3, 6]);
});

test("at higher speeds, the audio may be further away, because its own delays weigh more", () => {
  const { audio, show } = makeSound();
  show(1, { speed: 4 });
  assert.equal(audio.playbackRate, 4);
  audio.runTo(2.35);
  show(2, { speed: 4 });
  assert.deepEqual(audio.moves, [1]);
});

test("in a browser that moves audio slowly, the audio is moved ahead of the picture", () => {
  const { audio, show } = makeSound();
  show(1);
  audio.runTo(1.8);
  show(2);
  assert.deepEqual(audio.moves.map((time) => time.toFixed(2)), ["1.00", "2.20"]);
  show(7); // a seek does not change this
  assert.equal(audio.moves.at(-1)?.toFixed(2), "7.20");
  show(7.5, { isPlaying: false });
  assert.equal(audio.moves.at(-1), 7.5, "audio that is silent is not ahead");
  show(7.5);
  audio.runTo(8.2); // the browser is fast again
  show(8);
  assert.equal(audio.moves.at(-1)?.toFixed(2), "8.00");
});

test("audio that is being moved is left alone", () => {
  const { audio, show } = makeSound();
  show(1);
  audio.seeking = true;
  show(5);
  assert.deepEqual(audio.moves, [1]);
  audio.seeking = false;
  show(6);
  assert.deepEqual(audio.moves, [1, 6]);
});

test("audio waits if no picture follows in the duration of a picture, which depends on the speed", (context) => {
  const { show } = makeSound();
  const delays: unknown[] = [];
  context.mock.method(window, "setTimeout", (_: unknown, delay: number) => delays.push(delay));
  for (const speed of [0.5, 4]) show(1, { durationSeconds: 2, speed });
  assert.deepEqual(delays, [4100, 600]);
});

test("without pictures, during a pause, before its start and after its end, audio is silent", async () => {
  const { audio, show } = makeSound(-1);
  const isSilent = (seconds: number, more: Partial<ShownPicture> = {}): boolean => {
    show(seconds, more);
    return audio.paused;
  };
  assert.deepEqual([0.5, 1.5, 11.5, 2].map((seconds) => isSilent(seconds)), [true, false, true, false]);
  assert.ok(audio.moves.every((time) => time >= 0 && time < 10), `${audio.moves}`);
  assert.deepEqual([isSilent(2, { isPlaying: false }), isSilent(2)], [true, false]);
  assert.deepEqual([0.05, 1 / 16, 16, 17].map((speed) => isSilent(2, { speed })), [true, false, false, true]);
  assert.equal(isSilent(3, { durationSeconds: 0.01 }), false);
  await new Promise((resolve) => setTimeout(resolve, 500));
  assert.equal(audio.paused, true, "no picture came after 0.11 s");
});

test("audio that has just ended is not started again, but a loop starts it", () => {
  const { audio, show } = makeSound();
  show(9);
  audio.runTo(10);
  audio.ended = audio.paused = true;
  show(9.95);
  assert.equal(audio.paused, true);
  show(0);
  assert.deepEqual([audio.paused, audio.currentTime], [false, 0]);
});

test("if the browser refuses to play, the next click or key starts the audio", async () => {
  FakeAudio.playError = "NotAllowedError";
  const { sound, audio, show, log } = makeSound();
  show(1);
  await Promise.resolve();
  assert.equal(sound.state, "blocked");
  show(2);
  assert.deepEqual(audio.moves, [1], "blocked audio does not follow");
  FakeAudio.playError = null;
  window.dispatchEvent(new Event("keydown"));
  assert.deepEqual([sound.state, audio.paused, audio.currentTime], ["ready", false, 2]);
  assert.deepEqual(log, ["ready", "blocked", "ready"]);
});

test("a failure is reported once, and another file can follow", () => {
  const { sound, audio, show, log } = makeSound();
  for (let count = 0; count < 2; count++) audio.dispatchEvent(new Event("error"));
  show(1);
  assert.deepEqual([sound.state, audio.paused], ["failed", true]);
  assert.deepEqual(log, ["ready", "the audio file a.wav cannot be played: of the file"]);
  sound.url = "b.wav";
  show(2);
  assert.deepEqual([sound.state, audio.paused], ["ready", false]);
});

test("a new file, or none, replaces the file, and a click after the disposal starts nothing", async () => {
  FakeAudio.playError = "NotAllowedError";
  const { sound, audio, show } = makeSound();
  show(1);
  await Promise.resolve();
  assert.equal(sound.state, "blocked");
  sound.dispose();
  FakeAudio.playError = null;
  window.dispatchEvent(new Event("click"));
  assert.deepEqual([sound.state, audio.paused, sound.url], ["blocked", true, null]);
  const { sound: other, audio: otherAudio, show: showOther } = makeSound();
  other.url = null;
  showOther(1);
  assert.deepEqual([other.state, otherAudio.paused], ["none", true]);
});

test("audio that cannot be sought is downloaded, and its copy is released with it", async (context) => {
  const urls: string[] = [];
  context.mock.method(globalThis, "fetch", async () => new Response("audio"));
  context.mock.method(URL, "createObjectURL", () => `blob:${urls.push("")}`);
  context.mock.method(URL, "revokeObjectURL", (url: string) => urls.push(url));
  const { sound, audio } = makeSound();
  for (const end of [9.95, 1, 1]) {
    audio.seekable = { length: 1, end: () => end };
    audio.dispatchEvent(new Event("loadedmetadata"));
    await new Promise((resolve) => setImmediate(resolve));
    assert.equal(audio.src, end === 1 ? "blob:1" : "a.wav");
  }
  sound.url = "b.wav";
  assert.deepEqual([audio.src, urls], ["b.wav", ["", "blob:1"]]);
});
