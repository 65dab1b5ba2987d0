// SPDX-License-Identifier: MIT
// Starts `hal lsp` for the files of a machine, and sends changes to the running machine by a command.
const vscode = require('vscode');
const {LanguageClient} = require('vscode-languageclient/node');

let client;

function activate(context) {
    const settings = vscode.workspace.getConfiguration('halcyon');
    const server = {command: settings.get('program'), args: ['lsp']};
    client = new LanguageClient('halcyon', 'HAL', server, {
        documentSelector: [
            {scheme: 'file', language: 'halcyon'},
            {scheme: 'untitled', language: 'halcyon'},
            {scheme: 'file', language: 'halcyon-config'},
            {scheme: 'file', pattern: '**/*.ini'},
        ],
        initializationOptions: settings,
        synchronize: {
            configurationSection: 'halcyon',
            fileEvents: vscode.workspace.createFileSystemWatcher(
                '**/*.{hal,ini,canopen,ethercat,tdma,scocan,modbus,eds,esi,xml}'),
        },
    });
    const apply = vscode.commands.registerTextEditorCommand('halcyon.applyChanges', (editor) =>
        client.sendRequest('workspace/executeCommand', {
            command: 'halcyon.apply',
            arguments: [client.code2ProtocolConverter.asUri(editor.document.uri)],
        }));
    context.subscriptions.push(apply);
    return client.start();
}

function deactivate() { return client?.stop(); }

module.exports = {activate, deactivate};
