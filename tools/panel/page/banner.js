// SPDX-License-Identifier: MIT
// The texts of the banner at the top of each view.

/// What the banner says; empty while everything is as it should be, or is not known yet.
export function problemOf({server, reason, machine, responding, instance}) {
    if (server === 'connecting') return '';
    if (server === 'lost')
        return `No connection to hal panel${reason ? `: ${reason}` : ''}. Values are stale; ` +
            'reconnecting …';
    if (machine === null) return '';  // no answer yet
    if (!machine)
        return `Machine '${instance}' is not running. Values are stale; waiting for it. ` +
            'Start it with: hal run FILE.hal';
    if (!responding) return `Machine '${instance}' does not respond. Values are stale.`;
    return '';
}

/// What the banner says of a machine whose values are valid, but whose functions do not run.
export function pauseOf({server, machine, running, instance, past}) {
    if (server !== 'up' || !machine || running) return '';
    if (past) return 'The machine was stopped at this moment: its functions did not run.';
    return `Machine '${
        instance}' is stopped: its functions do not run. To start it: hal shell start`;
}
