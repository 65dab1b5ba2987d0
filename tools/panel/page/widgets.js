// SPDX-License-Identifier: MIT
// The widgets of user panels. Each maker returns an element that follows its pins.
import {h, text, number} from './dom.js';
import {knob, makeBar, makeChart, makeMeter} from './instruments.js';
import {follow, formatted} from './widget_values.js';

function disabled(node, pins, element) {
    pins.bind(node.disable, value => {
        element.classList.toggle('w-disabled', Boolean(value));
        if (node.widget === 'button')
            element.disabled = Boolean(value) || element.getAttribute('aria-disabled') === 'true';
    });
}

const label = (node, pins) => {
    const element = h('div', {class: 'w-label'}, String(node.options?.text ?? ''));
    disabled(node, pins, element);
    return element;
};

const multilabel = (node, pins) => {
    const element = h('div', {class: 'w-label'}), legends = node.options?.legends ?? [];
    const draw = () => {
        for (let i = node.pins.length - 1; i >= 0; i--)
            if (pins.value(node.pins[i])) return text(element, String(legends[i]));
        return text(element, '');
    };
    node.pins.forEach(pin => pins.bind(pin, draw));
    disabled(node, pins, element);
    return element;
};

function led(node, pins) {
    const options = node.options ?? {}, round = node.widget === 'led';
    const lamp = h('span', {class: round ? 'w-led' : 'w-led w-rect', role: 'img'}),
          title = node.kind ? options.text ?? node.pin : '';
    lamp.style.width = `${options.size ?? (round ? 20 : options.width ?? 30)}px`;
    lamp.style.height = `${options.size ?? (round ? 20 : options.height ?? 10)}px`;
    let on = false, off = false;
    const draw = () => {
        lamp.style.background = off ? options.disabled_color || '#ccc' :
            on                      ? options.on_color || options.on || '#18a030' :
                 options.off_color || options.off || (node.kind ? '#8884' : '#d02020');
        lamp.setAttribute(
            'aria-label',
            `${title || node.pin} ${
                off    ? 'disabled' :
                    on ? 'on' :
                         'off'}`);
        lamp.dataset.on = on;
    };
    follow(node, pins, value => {
        on = Boolean(value);
        draw();
    });
    pins.bind(node.disable, value => {
        off = Boolean(value);
        draw();
    });
    draw();
    return title ? h('div', {class: 'w-line'}, lamp, h('span', {}, title)) : h('div', {}, lamp);
}

function button(node, pins) {
    const element = h('button', {'data-output': ''}, String(node.options?.text ?? node.pin));
    const press = value => {
        if (!element.disabled || !value) pins.write({[node.pin]: value});
        element.setAttribute('aria-pressed', String(value));
    };
    const release = () => {
        if (pins.value(node.pin)) press(false);
    };
    element.addEventListener('pointerdown', event => {
        element.setPointerCapture(event.pointerId);
        press(true);
    });
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture', 'blur'])
        element.addEventListener(end, release);
    element.addEventListener('keydown', event => {
        if ((event.key === ' ' || event.key === 'Enter') && !event.repeat) press(true);
    });
    element.addEventListener('keyup', event => {
        if (event.key === ' ' || event.key === 'Enter') release();
    });
    element.addEventListener('contextmenu', event => event.preventDefault());
    pins.release.push(release);
    pins.bind(node.pin, value => element.setAttribute('aria-pressed', String(Boolean(value))));
    disabled(node, pins, element);
    return element;
}

function checkbutton(node, pins) {
    const box = h('input', {
        type: 'checkbox',
        'data-output': '',
        onchange: () => pins.write({[node.pin]: box.checked})
    });
    pins.bind(node.pin, value => {
        box.checked = Boolean(value);
    });
    let last = null;
    pins.bind(node.change, value => {  // a rising edge toggles
        if (value && last === false) pins.write({[node.pin]: !pins.value(node.pin)});
        last = Boolean(value);
    });
    return h(
        'label', {class: 'w-line'}, box,
        h('span', {}, String(node.options?.text ?? (node.kind ? node.pin : ''))));
}

function radiobutton(node, pins, path) {
    const choices = node.options?.choices ?? [];
    const radios = node.pins.map((pin, i) => {
        const input = h('input', {
            type: 'radio',
            name: path,
            'data-output': '',
            onchange: () =>
                pins.write(Object.fromEntries(node.pins.map(other => [other, other === pin])))
        });
        pins.bind(pin, value => {
            if (value) input.checked = true;
        });
        return h('label', {class: 'w-line'}, input, h('span', {}, String(choices[i])));
    });
    return h(
        'div', {class: node.options?.orient ? 'w-box w-hbox' : 'w-box w-vbox', role: 'radiogroup'},
        radios);
}

function value(node, pins) {
    const options = node.options ?? {}, element = h('span', {class: 'w-number mono'});
    const unit = options.unit ?? pins.unit(node.pin);
    const usual = node.widget === 'number' ? '2.1f' : 'd',
          format = options.format ?? (node.kind ? null : usual);
    const digits = now => {
        if (format) return formatted(now, format);
        return options.digits !== undefined ? Number(now).toFixed(options.digits) : number(now);
    };
    follow(node, pins, now => text(element, `${digits(now)}${unit ? ` ${unit}` : ''}`));
    return node.kind ?
        h('div', {class: 'w-line'}, h('span', {}, options.text ?? node.pin), element) :
        element;
}

function timer(node, pins) {
    const element = h('span', {class: 'w-number mono'}, '00:00:00');
    let sum = 0, begun = null;
    pins.bind(node.run, value => {
        if (value && begun === null)
            begun = performance.now();
        else if (!value && begun !== null) {
            sum += performance.now() - begun;
            begun = null;
        }
    });
    let last = false;
    pins.bind(node.reset, value => {
        if (value && !last) {
            sum = 0;
            if (begun !== null) begun = performance.now();
        }
        last = Boolean(value);
    });
    const clock = setInterval(() => {
        const s = Math.floor((sum + (begun === null ? 0 : performance.now() - begun)) / 1000),
              two = n => String(n).padStart(2, '0');
        text(
            element, `${two(Math.floor(s / 3600))}:${two(Math.floor(s / 60) % 60)}:${two(s % 60)}`);
    }, 200);
    pins.ends.push(() => clearInterval(clock));
    return element;
}

/// The limits of an output: PyVCP's names end in an underscore.
const limits = (node, low, high) =>
    [node.options?.min_ ?? node.options?.min ?? low,
     node.options?.max_ ?? node.options?.max ?? high,
     node.options?.resolution ?? node.options?.step ?? null];

/// Follows a parameter pin: each change of it becomes the value, within the limits.
function parameter(node, pins, set) {
    let last = null;
    pins.bind(node.param, value => {
        if (last !== null && value !== last) set(Number(value));
        last = value;
    });
}

function spinbox(node, pins) {
    const [low, high, step] = limits(node, 0, 100), options = node.options ?? {},
                      format = options.format ?? (node.kind ? null : '2.1f');
    const clamp = value => Math.min(high, Math.max(low, value));
    const set = value => {
        if (Number.isFinite(value)) pins.write({[node.pin]: clamp(value)});
    };
    const input = h('input', {
        type: 'number',
        'data-output': '',
        min: String(low),
        max: String(high),
        step: String(step ?? 1),
        'aria-label': options.text ?? node.pin,
        onchange: () => set(Number(input.value)),
        onwheel: event => {
            if (document.activeElement === input) {
                event.preventDefault();
                set(pins.value(node.pin) - Math.sign(event.deltaY) * (step ?? 1));
            }
        }
    });
    pins.bind(node.pin, now => {
        if (now !== undefined) input.value = format ? formatted(now, format) : String(now);
    });
    parameter(node, pins, set);
    return node.kind ? h('label', {class: 'w-line'}, h('span', {}, options.text), input) : input;
}

function scale(node, pins) {
    const [first, last, step] = limits(node, 0, 10), options = node.options ?? {},
                        low = Math.min(first, last), high = Math.max(first, last),
                        by = step ?? (node.kind ? (high - low) / 100 : 1);
    const set = value => {
        const to =
            Number((Math.round(Math.min(high, Math.max(low, value)) / by) * by).toPrecision(12));
        pins.write(
            node.integer ? {[node.pin]: to, [node.integer]: Math.trunc(to)} : {[node.pin]: to});
    };
    const shown = h('output', {class: 'mono'}), inverted = first > last;
    const input = h('input', {
        type: 'range',
        'data-output': '',
        min: String(low),
        max: String(high),
        step: String(by),
        'aria-label': options.text ?? node.pin,
        oninput: () => set(inverted ? low + high - Number(input.value) : Number(input.value))
    });
    const vertical = !node.kind &&
        String(options.orient ?? 'VERTICAL').toUpperCase() !== 'HORIZONTAL' &&
        options.orient !== 'h';
    if (vertical) {
        input.style.writingMode = 'vertical-lr';
        input.style.minHeight = '100px';
    }
    pins.bind(node.pin, now => {
        if (now === undefined) return;
        const place = String(inverted ? low + high - now : now);
        if (input.value !== place) input.value = place;
        text(shown, number(now));
        input.setAttribute('aria-valuetext', number(now));
    });
    parameter(node, pins, set);
    return node.kind ?
        h('label', {class: 'w-line'}, h('span', {}, options.text), input, shown) :
        h('div', {class: vertical ? 'w-box w-vbox w-centre' : 'w-box w-hbox'}, shown, input);
}

function dial(node, pins) {
    const [low, high, step] = limits(node, -Infinity, Infinity);
    const clamp = value => Math.min(high, Math.max(low, value));
    const set = value => pins.write({[node.pin]: Number(clamp(value).toPrecision(12))});
    parameter(node, pins, set);
    return knob(node, pins, {
        step: step ?? .1,
        turn: (steps, by) => set((pins.value(node.pin) ?? 0) + steps * by),
        reset: () => set(node.initial ?? 0),
        low,
        high
    });
}

function jogwheel(node, pins) {
    let last = false;
    pins.bind(node.reset, value => {
        if (value && !last) pins.write({[node.pin]: 0});
        last = Boolean(value);
    });
    return knob(node, pins, {
        step: 1,
        turn: steps => pins.write({
            [node.pin]:
                (pins.value(node.pin) ?? 0) + steps * (node.scale ? pins.value(node.scale) : 1)
        }),
        low: -Infinity,
        high: Infinity
    });
}

function image(node, pins) {
    const element = h('img', {alt: ''}), sources = node.sources ?? [];
    pins.bind(node.pin, now => {
        const index = Number(now);
        if (sources[index]) element.src = sources[index];
        element.alt = String(node.names?.[index] ?? index);
    });
    return element;
}

export const makers = {
    label,
    multilabel,
    led,
    rectled: led,
    button,
    checkbutton,
    radiobutton,
    number: value,
    u32: value,
    s32: value,
    timer,
    bar: makeBar,
    meter: makeMeter,
    chart: makeChart,
    spinbox,
    scale,
    dial,
    jogwheel,
    image_bit: image,
    image_u32: image
};
