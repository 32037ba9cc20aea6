/**
 * Call a function when the size of an element in screen pixels changes: when it is resized, when the page is zoomed,
 * and when the window moves to a screen with another resolution.
 */
export function onScreenResize(element: Element, callback: () => void, signal: AbortSignal): void {
  const observer = new ResizeObserver(callback);
  observer.observe(element);
  signal.addEventListener("abort", () => observer.disconnect());
  watchPixelRatio(callback, signal);
}

/** A media query only tells whether one ratio applies, so each change needs a new query. */
function watchPixelRatio(callback: () => void, signal: AbortSignal): void {
  const query = matchMedia(`(resolution: ${devicePixelRatio}dppx)`);
  const handleChange = (): void => {
    callback();
    watchPixelRatio(callback, signal);
  };
  query.addEventListener("change", handleChange, { once: true, signal });
}
