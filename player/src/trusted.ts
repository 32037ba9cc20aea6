/** Texts of the player for pages that require Trusted Types: these take HTML and worker addresses only from a policy. */

interface Policy {
  createHTML(text: string): string;
  createScriptURL(text: string): string;
}

interface PolicyFactory {
  createPolicy(name: string, rules: Policy): Policy;
}

declare global {
  var trustedTypes: PolicyFactory | undefined;
}

const UNCHANGED: Policy = { createHTML: (text) => text, createScriptURL: (text) => text };
let policy: Policy | undefined;

/** Return the policy, under the name that the page's Content-Security-Policy must allow. */
export function trust(): Policy {
  try {
    policy ??= globalThis.trustedTypes?.createPolicy("quarc-player", UNCHANGED);
  } catch {
    // The page does not allow the policy. If it requires one, the browser reports what it rejects.
  }
  return (policy ??= UNCHANGED);
}
