import type { Browser } from "playwright-core";

export function measureThreads(browser: Browser): Promise<[page: number, sorter: number, decoder: number]>;
