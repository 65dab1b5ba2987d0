// SPDX-License-Identifier: MIT
// The amplitude spectrum of a channel. No drawing.

const most = 1 << 14;  // samples

/// The discrete Fourier transform in place (radix 2, decimation in time); the length is a power
/// of 2.
function transform(real, imaginary) {
    const length = real.length;
    for (let i = 1, j = 0; i < length; i++) {
        let bit = length >> 1;
        for (; j & bit; bit >>= 1)
            j ^= bit;
        j ^= bit;
        if (i >= j) continue;
        [real[i], real[j]] = [real[j], real[i]];
        [imaginary[i], imaginary[j]] = [imaginary[j], imaginary[i]];
    }
    for (let size = 2; size <= length; size *= 2) {
        const half = size / 2;
        for (let k = 0; k < half; k++) {
            const angle = -2 * Math.PI * k / size, cos = Math.cos(angle), sin = Math.sin(angle);
            for (let i = k; i < length; i += size) {
                const j = i + half, re = real[j] * cos - imaginary[j] * sin,
                      im = real[j] * sin + imaginary[j] * cos;
                real[j] = real[i] - re;
                imaginary[j] = imaginary[i] - im;
                real[i] += re;
                imaginary[i] += im;
            }
        }
    }
}

/// The place of the sine whose largest line is `k`, and its amplitude: exact under a Hann window,
/// whose lines are sin(pi d) / (pi d (1 - d^2)) at the distance d (Rife and Vincent, 1970).
function refined(amplitudes, k) {
    const side = amplitudes[k + 1] > amplitudes[k - 1] ? 1 : -1;
    const ratio = amplitudes[k + side] / amplitudes[k];
    const distance = (2 * ratio - 1) / (ratio + 1);
    const angle = Math.PI * distance;
    const shape = Math.sin(angle) / (angle * (1 - distance ** 2));
    return {
        place: k + side * distance,
        amplitude: Math.abs(distance) < 1e-6 ? amplitudes[k] : amplitudes[k] / shape
    };
}

/**
 * Computes the amplitude spectrum of a channel between two times: without the mean, with a Hann
 * window, over the newest power of 2 of samples, at most 16384. A sine has its amplitude.
 *
 * @param {import('./scope_data.js').Store} store
 * @param {string} name
 * @param {number} from s
 * @param {number} to s
 * @returns {{step: number, amplitudes: Float64Array,
 *     peak: {frequency: number, amplitude: number} | null} | null} `step` in Hz; null with fewer
 *     than 16 samples, or with a value that is not finite
 */
export function spectrum(store, name, from, to) {
    const place = store.place.get(name);
    if (!place) return null;
    const [group, column] = place, end = group.row(to), count = end - group.row(from);
    if (count < 16) return null;
    const length = Math.min(most, 2 ** Math.floor(Math.log2(count))), begin = end - length;
    const real = new Float64Array(length), imaginary = new Float64Array(length);
    let mean = 0;
    for (let i = 0; i < length; i++) {
        real[i] = group.value(column, begin + i);
        mean += real[i] / length;
    }
    const duration = group.time(end - 1) - group.time(begin);
    if (!Number.isFinite(mean) || !(duration > 0)) return null;
    for (let i = 0; i < length; i++)
        real[i] = (real[i] - mean) * (1 - Math.cos(2 * Math.PI * i / length)) / 2;
    transform(real, imaginary);
    // the window halves the sum; the other half is at negative frequencies
    const amplitudes =
        new Float64Array(length / 2).map((_, k) => Math.hypot(real[k], imaginary[k]) * 4 / length);
    const step = (length - 1) / (duration * length);
    let top = 1;
    for (let k = 2; k < amplitudes.length - 1; k++)
        if (amplitudes[k] > amplitudes[top]) top = k;
    if (!(amplitudes[top] > 0)) return {step, amplitudes, peak: null};
    const {place: at, amplitude} = refined(amplitudes, top);
    return {step, amplitudes, peak: {frequency: at * step, amplitude}};
}
