/** Audio in a browser: it follows playback, and has a button and a key. */

import assert from "node:assert/strict";
import { KEEP_AUDIO, makeWav } from "./audio-file.js";
import { browserTest, PlayerPage, type PageOptions, type PlayerElement } from "./browser.js";

const FRAME_RATE = 30; // of the stream
declare const audioElement: HTMLAudioElement;

function openPage(attributes: string, options: PageOptions = {}): Promise<PlayerPage> {
  return PlayerPage.open({
    attributes: `audio="sound.wav" ${attributes}`,
    files: { "/sound.wav": makeWav(5) },
    ...options,
    initScript: KEEP_AUDIO + (options.initScript ?? ""),
  });
}

/** Wait until the sound is heard at the time of the picture. */
async function waitForSync(page: PlayerPage, start: number): Promise<void> {
  await page.page.waitForFunction(`!audioElement.paused && !audioElement.seeking && Math.abs(audioElement.currentTime - ${start}
    - document.querySelector("quarc-player").frame / ${FRAME_RATE}) < 0.15`);
}

const waitForSilence = (page: PlayerPage): Promise<void> => page.waitUntil(() => audioElement.paused);
const muteButton = (page: PlayerPage) => page.page.locator("quarc-player #mute");

for (const supportsRanges of [true, false]) {
  browserTest(`audio plays, pauses, seeks and loops with the pictures, ${supportsRanges ? "with" : "without"} ranges`, async () => {
    await using page = await openPage('audio-start="1" speed="0.25" loop', { supportsRanges });
    await page.waitUntil((player) => player.frame === 0 && audioElement.paused);
    await page.page.waitForFunction("audioElement.seekable.length === 1 && audioElement.seekable.end(0) === 5");
    await page.setFrame(10);
    await page.waitUntil((player) => Math.abs(audioElement.currentTime - 1 - (player.frame ?? 0) / 30) < 0.01);
    await page.run((player) => player.play());
    await waitForSync(page, 1);
    assert.equal(await page.run(() => audioElement.playbackRate), 0.25);
    await page.run((player) => player.pause());
    await waitForSilence(page);
    await page.run((player) => {
      player.setAttribute("speed", "1");
      player.play();
    });
    for (let lap = 0; lap < 2; lap++) {
      await page.waitUntil((player) => (player.frame ?? 0) > 16);
      await page.waitUntil((player) => (player.frame ?? 24) < 8);
      await waitForSync(page, 1);
    }
    assert.equal(await page.run(() => audioElement.playbackRate), 1);
    await page.run((player) => player.removeAttribute("loop"));
    await page.waitUntil((player) => player.frame === 23 && !player.isPlaying);
    await waitForSilence(page);
  });
}

browserTest("audio is silent before its start and after its end", async () => {
  await using page = await openPage('audio-start="-0.3" speed="0.25"', { files: { "/sound.wav": makeWav(0.3) } });
  await page.waitUntil((player) => player.frame === 0);
  const frames = await page.run(async (player) => {
    const heardFrames: number[] = [];
    player.addEventListener("frame", ({ detail }) => audioElement.paused || heardFrames.push(detail.frame));
    const ended = new Promise((resolve) => player.addEventListener("ended", resolve));
    player.play();
    await ended;
    return heardFrames;
  });
  assert.ok(frames.length > 0 && Math.min(...frames) >= 9 && Math.max(...frames) <= 18, String(frames));
});

browserTest("audio that has lost the pictures finds them again", async () => {
  await using page = await openPage('speed="0.25" autoplay loop');
  await waitForSync(page, 0);
  await page.run(() => void (audioElement.currentTime = 3));
  await waitForSync(page, 0);
});

browserTest("audio waits while the pictures wait", async () => {
  await using page = await openPage('speed="0.25" loop', { heldFrom: 45_000, supportsRanges: false });
  await page.waitUntil((player) => player.frame === 0 && audioElement.seekable.length > 0 && audioElement.seekable.end(0) === 5);
  await page.run((player) => {
    const started = new Promise((resolve) => audioElement.addEventListener("play", () => resolve(true)));
    player.play();
    return started;
  });
  await page.waitUntil((player) => player.player?.isWaiting === true && (player.frame ?? 0) > 0);
  await waitForSilence(page);
  page.server.setOptions({ heldFrom: Infinity });
  await waitForSync(page, 0);
});

browserTest("a button and a key mute the audio; without audio, there is no button", async () => {
  await using page = await openPage("");
  await page.waitUntil((player) => player.frame === 0);
  const button = muteButton(page);
  const readState = (): Promise<[boolean | undefined, boolean]> => page.run(({ player }) => [player?.muted, audioElement.muted]);
  await button.click();
  assert.deepEqual(await readState(), [true, true]);
  await page.page.locator('quarc-player #mute[aria-label="Unmute"]').waitFor();
  await page.page.keyboard.press("m");
  assert.deepEqual(await readState(), [false, false]);
  await page.page.locator('quarc-player #mute[aria-label="Mute"]').waitFor();
  const heardEvent = page.run((player) => new Promise((resolve) => player.addEventListener("settings", () => resolve(true))));
  await page.run((player) => player.setAttribute("muted", ""));
  assert.deepEqual([await heardEvent, await readState()], [true, [true, true]]);
  await page.run((player) => player.removeAttribute("audio"));
  await button.waitFor({ state: "hidden" });
  assert.equal(await page.run(({ player }) => player?.audioState), "none");
  const state = await page.run((player) => {
    player.setAttribute("audio", "");
    return [player.player?.audio, player.player?.audioState];
  });
  assert.deepEqual(state, [null, "none"]);
});

browserTest("if the browser refuses to play, pictures go on, and the mute button starts the sound", async () => {
  const initScript = `
    const { play } = HTMLMediaElement.prototype;
    let isAllowed = false;
    addEventListener("pointerdown", () => (isAllowed = true), true);
    HTMLMediaElement.prototype.play = function () {
      return isAllowed ? play.call(this) : Promise.reject(new DOMException("", "NotAllowedError"));
    };`;
  await using page = await openPage('autoplay loop speed="0.25"', { initScript });
  await page.waitUntil((player) => player.isPlaying && (player.frame ?? 0) > 1 && audioElement.paused);
  await page.page.locator('quarc-player #mute[aria-label="Unmute"]').click();
  await waitForSync(page, 0);
  assert.deepEqual(await page.run(({ player }) => [player?.audioState, player?.muted]), ["ready", false]);
});

for (const [name, file] of [["is missing", null], ["is not audio", "text"]] as const) {
  browserTest(`an audio file that ${name} is reported once, and pictures go on`, async () => {
    const listener = `
      window.messages = [];
      addEventListener("DOMContentLoaded", () => {
        document.querySelector("quarc-player").addEventListener("audioerror", (event) => messages.push(event.detail.message));
      });`;
    const files = file === null ? {} : { "/sound.wav": file };
    await using page = await openPage('autoplay speed="8"', { files, initScript: listener, expectedErrors: /404|sound\.wav/ });
    await page.waitUntil((player) => player.frame === 23 && player.player?.audioState === "failed");
    const messages = await page.page.evaluate<string[]>("messages");
    assert.equal(messages.length, 1);
    assert.match(messages[0] ?? "", /^the audio file sound\.wav cannot be played: ./);
    assert.equal(page.errors.filter((text) => text.includes("cannot be played")).length, 1);
    assert.equal(await muteButton(page).isVisible(), false);
  });
}

browserTest("a program sets audio, its start and its volume", async () => {
  await using page = await openPage("");
  await page.waitUntil((player) => player.frame === 0);
  const state = await page.run(({ player }: PlayerElement) => {
    Object.assign(player!, { audioStart: 2, volume: 0.5, muted: true, audio: "sound.wav?2" });
    return [player?.audioStart, audioElement.volume, player?.muted, player?.audio, player?.audioState];
  });
  assert.deepEqual(state, [2, 0.5, true, "sound.wav?2", "ready"]);
  await page.run((player) => player.setFrame(3));
  await page.run((player) => player.play());
  await waitForSync(page, 2);
});
