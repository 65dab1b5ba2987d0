// SPDX-License-Identifier: MIT
// The texts of the banner at the top of each view.

/// A command as the user has to type it: `hal` is how hal panel was started.
function command(hal, words, instance) {
    const named = instance === 'default' ? '' : `--name ${instance} `;
    return `${hal} ${words[0]} ${named}${words[1]}`;
}

/// What the banner says; empty while everything is as it should be, or is not known yet.
export function problemOf({server, reason, machine, responding, instance, hal}) {
    if (server === 'connecting') return '';
    if (server === 'lost')
        return `No connection to hal panel${reason ? `: ${reason}` : ''}. Values are stale; ` +
            'reconnecting …';
    if (machine === null) return '';  // no answer yet
    if (!machine)
        return `Machine '${instance}' is not running. Values are stale; waiting for it. ` +
            `To start it, type: ${command(hal, ['run', 'FILE.hal'], instance)}`;
    if (!responding) return `Machine '${instance}' does not respond. Values are stale.`;
    return '';
}

/// What the banner says of a machine whose values are valid, but whose functions do not run.
export function pauseOf({server, machine, running, instance, past, hal}) {
    if (server !== 'up' || !machine || running) return '';
    if (past) return 'The machine was stopped at this moment: its functions did not run.';
    return `Machine '${instance}' is stopped: its functions do not run. To start it, type: ` +
        command(hal, ['shell', 'start'], instance);
}
