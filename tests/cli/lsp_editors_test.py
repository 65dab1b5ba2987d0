# SPDX-License-Identifier: MIT
"""The settings of docs/editors.md: Neovim without a window runs its own; the others are valid and name what exists."""

import json
import re
import shutil
import subprocess
import sys
import unittest
import xml.etree.ElementTree

from harness import HAL, ROOT, TIMEOUT, Case

if sys.version_info >= (3, 11):
    import tomllib

PAGE = (ROOT / "docs" / "editors.md").read_text()
VSCODE = ROOT / "tools" / "lsp" / "vscode"
ENDINGS = {"hal", "canopen", "ethercat", "tdma", "scocan", "modbus", "panel"}

# What Neovim 0.8 has by itself.
BEFORE = """
vim.g.do_filetype_lua = 1
if not vim.lsp.start then
  vim.lsp.start = function(config)
    local id = vim.lsp.start_client(config)
    vim.lsp.buf_attach_client(0, id)
    return id
  end
end
"""
# Opens a netlist, waits for the errors, renames, writes what was seen.
AFTER = """
local output = {}
vim.cmd('edit m.hal')
vim.wait(TIMEOUT, function() return #vim.diagnostic.get(0) > 0 end, 10)
for _, one in ipairs(vim.diagnostic.get(0)) do
  table.insert(output, one.lnum .. ':' .. one.col .. ' ' .. one.code)
end
local params = { textDocument = { uri = vim.uri_from_bufnr(0) }, position = { line = 2, character = 4 }, newName = 'sum' }
for _, answer in pairs(vim.lsp.buf_request_sync(0, 'textDocument/rename', params, TIMEOUT)) do
  vim.lsp.util.apply_workspace_edit(answer.result, 'utf-16')
end
for _, answer in pairs(vim.lsp.buf_request_sync(0, 'textDocument/hover', { textDocument = params.textDocument, position = { line = 1, character = 8 } }, TIMEOUT)) do
  table.insert(output, answer.result.contents.value:match('Weighted sum') or 'no hover')
end
table.insert(output, vim.api.nvim_buf_get_lines(0, 2, 3, true)[1])
table.insert(output, vim.bo.filetype)
vim.fn.writefile(output, 'output')
"""


def block(language):
    return re.search(rf"^```{language}\n(.*?)^```", PAGE, re.M | re.S)[1]


class Editors(Case):
    @unittest.skipUnless(shutil.which("nvim"), "Neovim is not installed: apt install neovim")
    def test_neovim_with_the_settings_of_the_page(self):
        self.write("m.hal", "newthread t 1ms\nloadrt sum2\nnet total sum2.0.out sum2.0.inn\n")
        timeout = str(int(1000 * TIMEOUT))
        self.write("init.lua", BEFORE + block("lua"))
        self.write("after.lua", AFTER.replace("TIMEOUT", timeout))
        (self.folder / "bin").mkdir()
        (self.folder / "bin" / "hal").symlink_to(HAL)
        done = subprocess.run(
            [
                *("nvim", "--headless", "--clean", "-u", "init.lua"),
                *("-c", "luafile after.lua", "-c", "qall!"),
            ],
            cwd=self.folder,
            env={**self.environment, "PATH": f"{self.folder / 'bin'}:{self.environment['PATH']}"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=4 * TIMEOUT,
        )
        output = self.folder / "output"
        self.assertTrue(output.exists(), done.stdout)
        self.assertEqual(
            ["2:21 no-such-pin", "Weighted sum", "net sum sum2.0.out sum2.0.inn", "halcyon"],
            output.read_text().splitlines(),
            done.stdout,
        )

    def test_helix_and_kate(self):
        if sys.version_info >= (3, 11):
            settings = tomllib.loads(block("toml"))
            self.assertEqual(ENDINGS, set(settings["language"][0]["file-types"]))
            self.assertEqual(["lsp"], settings["language-server"]["halcyon"]["args"])
        kate = json.loads(block("json"))["servers"]["halcyon"]
        self.assertEqual(["hal", "lsp"], kate["command"])
        mode = xml.etree.ElementTree.parse(ROOT / "tools/lsp/kate/halcyon.xml").getroot()
        self.assertRegex(mode.get("name"), kate["highlightingModeRegex"])
        self.assertEqual(
            ENDINGS, {one.removeprefix("*.") for one in mode.get("extensions").split(";")}
        )
        attributes = {one.get("name") for one in mode.iter("itemData")}
        used = {one.get("attribute") for one in mode.iter() if one.get("attribute")}
        self.assertLessEqual(used, attributes)

    def test_the_extension_of_vs_code_is_complete(self):
        package = json.loads((VSCODE / "package.json").read_text())
        contributed = package["contributes"]
        endings = {e[1:] for one in contributed["languages"] for e in one["extensions"]}
        self.assertEqual(ENDINGS, endings)
        for grammar in contributed["grammars"]:
            syntax = json.loads((VSCODE / grammar["path"]).read_text())
            self.assertEqual(grammar["scopeName"], syntax["scopeName"])
        script = (VSCODE / package["main"]).read_text()
        for command in contributed["commands"]:
            self.assertIn(f"'{command['command']}'", script)
        help_text = self.good("help", "lsp")
        for setting in contributed["configuration"]["properties"]:
            name = setting.removeprefix("halcyon.")
            option = {"program": "lsp", "machine": "--name"}.get(name, "--" + name)
            self.assertIn(option, help_text)

    @unittest.skipUnless(shutil.which("npm"), "npm is not installed")
    def test_npm_packs_the_extension(self):
        copy = shutil.copytree(VSCODE, self.folder / "vscode")
        done = subprocess.run(
            ["npm", "pack", "--json", "--offline"],
            cwd=copy,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=4 * TIMEOUT,
        )
        self.assertEqual(0, done.returncode, done.stderr)
        packed = {one["path"] for one in json.loads(done.stdout)[0]["files"]}
        self.assertLessEqual(
            {"package.json", "extension.js", "hal.tmLanguage.json", "README.md"}, packed
        )
        subprocess.run(["node", "--check", "extension.js"], cwd=copy, check=True, timeout=TIMEOUT)


if __name__ == "__main__":
    unittest.main()
