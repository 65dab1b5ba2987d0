// SPDX-License-Identifier: MIT
// The values of widgets: where they come from, and how they are written.

/// A number by Python's % format without the %: 2.1f, d, +4.3e.
export function formatted(value, format) {
    const [, flags = '', width = '', digits, kind = 'f'] =
        /^([-+ 0#]*)(\d*)(?:\.(\d+))?([a-zA-Z]?)/.exec(format ?? '') ?? [];
    let out;
    if (kind === 'd' || kind === 'i' || kind === 'u')
        out = String(Math.trunc(value));
    else if (kind === 'x' || kind === 'X' || kind === 'o')
        out = Math.trunc(value).toString(kind === 'o' ? 8 : 16);
    else if (kind === 'e' || kind === 'E')
        out = Number(value).toExponential(Number(digits ?? 6)).replace(/e([-+])(\d)$/, 'e$10$2');
    else if (kind === 'g' || kind === 'G')
        out = String(Number(Number(value).toPrecision(Number(digits ?? 6) || 1)));
    else
        out = Number(value).toFixed(Number(digits ?? 6));
    if (kind === 'X' || kind === 'E') out = out.toUpperCase();
    if (flags.includes('+') && value >= 0) out = '+' + out;
    return flags.includes('0') ? out.padStart(Number(width), '0') : out;
}

/// Follows the pin of a node, or the name of the machine in its `of`.
export function follow(node, pins, act) {
    if (node.of)
        pins.source(node.of, value => {
            if (value !== null) act(value);
        });
    else
        pins.bind(node.pin, act);
}

/// The next of 1, 2, 5, 10 … times a power of ten that is not smaller.
export function nice(size) {
    const e = 10 ** Math.floor(Math.log10(size));
    return e * [1, 2, 5, 10].find(step => size / e <= step || step === 10);
}
