/** The style of the component: dark, with one accent color. */

export const STYLE = `
:host { display: block; position: relative; overflow: hidden; direction: ltr; text-align: start; aspect-ratio: 16 / 10; min-height: 240px;
  container-type: size; background: #0d0f12; color: #d9dde3; color-scheme: dark; --accent: #6aa8ff;
  font: 13px/1.4 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; border-radius: 8px; }
:host(:fullscreen) { border-radius: 0; }
:host([hidden]) { display: none; }
:host([transparent]), :host([transparent]) :is(canvas.view, .poster) { background: none; }
:host([transparent]) canvas.view:has(+ .poster:not([hidden])) { opacity: 0; } /* a poster may be transparent, too */
:host([controls="none"]) .bar { display: none; }
* { box-sizing: border-box; }
[hidden] { display: none !important; }
.frame { position: absolute; inset: 0; display: flex; flex-direction: column; }
.picture { position: relative; flex: 1 0 40%; overflow: hidden; }
canvas.view { position: absolute; inset: 0; width: 100%; height: 100%; display: block; outline: none;
  cursor: grab; background: #000; }
.poster { position: absolute; inset: 0; width: 100%; height: 100%; object-fit: contain; background: #000; pointer-events: none; }
canvas.view:active { cursor: grabbing; }
canvas.view:focus-visible { outline: 2px solid var(--accent); outline-offset: -2px; }
.bar { overflow-y: auto; background: #14171c; border-top: 1px solid #23282f; padding: 8px 12px 8px;
  padding-bottom: max(8px, env(safe-area-inset-bottom)); }
.timeline { position: relative; height: 34px; border-radius: 4px; }
.timeline canvas { position: absolute; inset: 0; width: 100%; height: 100%; }
.timeline input { position: absolute; inset: 0; width: 100%; height: 100%; margin: 0; opacity: 0; cursor: pointer; }
.timeline:focus-within { outline: 2px solid var(--accent); }
.timeline:not(:has(input:focus-visible)) { outline: none; }
.row { display: flex; align-items: center; gap: 2px; margin-top: 6px; flex-wrap: wrap; }
button { all: unset; box-sizing: border-box; width: 36px; height: 36px; padding: 8px; border-radius: 6px;
  color: #aeb6c2; cursor: pointer; transition: background .12s, color .12s; }
button:hover { background: #222831; color: #fff; }
button:focus-visible, select:focus-visible { outline: 2px solid var(--accent); outline-offset: -1px; }
button[aria-pressed="true"] { color: var(--accent); }
button.main { color: #fff; background: #222831; margin-right: 4px; }
button.main:hover { background: var(--accent); color: #0d0f12; }
#live { display: flex; align-items: center; gap: 6px; width: auto; padding: 0 8px; white-space: nowrap;
  font-variant-numeric: tabular-nums; }
#live i { width: 8px; height: 8px; border-radius: 50%; background: #5b6675; }
#live[aria-pressed="true"] { color: #fff; }
#live[aria-pressed="true"] i { background: #ff5252; }
svg { display: block; width: 100%; height: 100%; }
.time { margin: 0 8px; font-variant-numeric: tabular-nums; color: #aeb6c2; white-space: nowrap; }
.time b { color: #fff; font-weight: 600; }
.gap { flex: 1; }
select { font: inherit; height: 30px; max-width: 190px; padding: 0 6px; margin: 0 2px; border-radius: 6px;
  border: 1px solid #2b313a; background: #1a1e24; color: #d9dde3; text-overflow: ellipsis; }
#camera:not(:has(option)) { visibility: hidden; } /* no stream yet */
.statistics { position: absolute; top: 10px; left: 10px; max-height: calc(100% - 20px); overflow-y: auto; margin: 0;
  padding: 8px 12px; border-radius: 6px;
  background: #0d0f12e6; display: grid; grid-template-columns: auto auto; gap: 1px 14px; pointer-events: none;
  font-size: 12px; font-variant-numeric: tabular-nums; }
.statistics dt { color: #8b94a1; }
.statistics dd { margin: 0; text-align: right; }
.loading { position: absolute; inset: auto 0 16px; width: fit-content; margin: auto; padding: 6px 14px 8px; border-radius: 6px;
  background: #0d0f12cc; text-align: center; font-variant-numeric: tabular-nums; }
.loading progress { display: block; width: 180px; max-width: 100%; height: 3px; margin: 5px auto 0; appearance: none; border: 0; border-radius: 2px;
  overflow: hidden; background: #2b313a; }
.loading progress::-webkit-progress-bar { background: #2b313a; }
.loading progress::-webkit-progress-value { background: var(--accent); }
.loading progress::-moz-progress-bar { background: var(--accent); }
.fault { position: absolute; inset: 0; display: grid; place-content: safe center; overflow-y: auto; padding: 16px;
  background: #0d0f12b8; }
.fault div { max-width: 460px; padding: 18px 22px; border-radius: 8px; background: #14171c; border: 1px solid #2b313a;
  border-left: 3px solid var(--accent); box-shadow: 0 8px 32px #0008; }
.fault h2 { margin: 0 0 6px; font-size: 15px; font-weight: 600; color: #fff; }
.fault p { margin: 0; overflow-wrap: anywhere; }
.fault p + p { margin-top: 8px; color: #8b94a1; }
.fault code { font: 12px ui-monospace, "SF Mono", Menlo, monospace; color: var(--accent); }
.fault button { width: auto; height: auto; margin-top: 12px; padding: 6px 14px; background: #222831; color: #fff; }
.fault button:hover { background: var(--accent); color: #0d0f12; }
.waiting { position: absolute; left: 50%; top: 50%; width: 36px; height: 36px; margin: -18px; border-radius: 50%;
  border: 3px solid #ffffff38; border-top-color: #fff; filter: drop-shadow(0 0 2px #000);
  animation: turn 1s linear infinite; pointer-events: none; }
@keyframes turn { to { transform: rotate(1turn); } }
@container (max-width: 520px) {
  .bar { padding: 6px 8px; padding-bottom: max(6px, env(safe-area-inset-bottom)); }
  .time { flex: 1; margin: 0 4px; text-align: right; }
  .gap { flex-basis: 100%; height: 0; }
  button { width: 40px; height: 40px; padding: 9px; }
  select { height: 36px; min-width: 0; }
  #camera { flex: 1; min-width: 80px; max-width: none; }
}
@container (max-width: 520px) or (max-height: 300px) {
  .fault { padding: 4px; }
  .fault div { padding: 8px 12px; }
  .statistics { pointer-events: auto; } /* it may have to be scrolled */
}
@media (prefers-reduced-motion: reduce) { * { transition: none !important; } .waiting { animation-duration: 4s; } }
`;
