// Starts `ovolo lsp` and lets it answer for all `.ovo` files.

const { workspace } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

exports.activate = () => {
  const command = workspace.getConfiguration("ovolo").get("command");
  client = new LanguageClient(
    "ovolo",
    "Ovolo",
    { command, args: ["lsp"] },
    { documentSelector: [{ language: "ovolo" }] },
  );
  return client.start();
};

exports.deactivate = () => client?.stop();
