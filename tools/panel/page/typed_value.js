// SPDX-License-Identifier: MIT
// Values that a user types, checked before they are sent.

const bits = {
    1: true,
    true: true,
    0: false,
    false: false
};
/// The smallest and the largest value of the integer types.
const limits = {
    s32: [-(2n ** 31n), 2n ** 31n - 1n],
    u32: [0n, 2n ** 32n - 1n],
    s64: [-(2n ** 63n), 2n ** 63n - 1n],
    u64: [0n, 2n ** 64n - 1n]
};

/// The range of a type, for people; empty for a type without limits.
export function rangeOf(type) {
    const [low, high] = limits[type] ?? [];
    return low === undefined ? '' : `${low} .. ${high}`;
}

function integer(type, word) {
    if (!/^[-+]?\d+$/.test(word)) return {problem: `'${word}' is not an integer`};
    const value = BigInt(word.replace(/^\+/, '')), [low, high] = limits[type];
    if (value < low || value > high)
        return {problem: `${word} is out of the range of ${type}: ${rangeOf(type)}`};
    return {value: String(value)};  // as text: a number of JavaScript has 53 bits
}

/**
 * The value that was typed, for the protocol.
 * @param {string} type of the pin or signal
 * @param {string} text
 * @returns {{value?: boolean | number | string, problem?: string}} one of the two
 */
export function typedValue(type, text) {
    const word = text.trim();
    if (word === '') return {problem: 'type a value'};
    if (type === 'bit') {
        const value = bits[word.toLowerCase()];
        return value === undefined ? {problem: `'${word}' is not TRUE or FALSE`} : {value};
    }
    if (/^[-+]?\d+,\d+$/.test(word))
        return {problem: `'${word}' is not a number; write ${word.replace(',', '.')}`};
    if (limits[type]) return integer(type, word);
    const value = Number(word);
    return Number.isFinite(value) ? {value} : {problem: `'${word}' is not a number`};
}
