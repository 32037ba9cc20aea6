/** The contents of the buttons: SVG icons in the color of the text, and the word "Live". */

const makeIcon = (shapes: string): string =>
  `<svg viewBox="0 0 24 24" aria-hidden="true" fill="none" stroke="currentColor" ` +
  `stroke-width="1.8" stroke-linecap="round" stroke-linejoin="round">${shapes}</svg>`;
const FILL = 'fill="currentColor"';
const SPEAKER = `<path d="M4 9.5v5h3.5L12 19V5L7.5 9.5z" ${FILL}/>`;

export const ICONS = {
  play: makeIcon(`<path d="M8 5.5v13l10.5-6.5z" ${FILL}/>`),
  pause: makeIcon(`<path d="M8 6v12M16 6v12" stroke-width="3.4"/>`),
  back: makeIcon(`<path d="M17 6v12l-8.5-6z" ${FILL}/><path d="M6 6v12"/>`),
  forward: makeIcon(`<path d="M7 6v12l8.5-6z" ${FILL}/><path d="M18 6v12"/>`),
  loop: makeIcon(`<path d="M17 3l3.5 3.5L17 10M3.5 11V9a2.5 2.5 0 0 1 2.5-2.5h14M7 21l-3.5-3.5L7 14M20.5 13v2a2.5 2.5 0 0 1-2.5 2.5H4"/>`),
  live: `<i></i><span>Live</span>`,
  sound: makeIcon(`${SPEAKER}<path d="M15.5 9a4.2 4.2 0 0 1 0 6M18 6.5a7.8 7.8 0 0 1 0 11"/>`),
  silence: makeIcon(`${SPEAKER}<path d="M16 9l6 6M22 9l-6 6"/>`),
  flip: makeIcon(`<path d="M7 20V5M3.5 8.5L7 5l3.5 3.5M17 4v15M13.5 15.5L17 19l3.5-3.5"/>`),
  statistics: makeIcon(`<path d="M5 20v-7M12 20V4M19 20v-10" stroke-width="2.4"/>`),
  headset: makeIcon(`<path d="M5 7h14a2 2 0 0 1 2 2v6a2 2 0 0 1-2 2h-3.5L12 14l-3.5 3H5a2 2 0 0 1-2-2V9a2 2 0 0 1 2-2z"/>`),
  fullscreen: makeIcon(`<path d="M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5"/>`),
} as const;
