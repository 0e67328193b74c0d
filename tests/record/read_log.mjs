// Count a log's messages by topic with @mcap/core; the folder of its node_modules is the second argument.
import { createRequire } from "module";
import { open } from "fs/promises";

const require = createRequire(process.argv[3] + "/");
const { McapIndexedReader } = require("@mcap/core");
const { decompress } = require("fzstd");

const file = await open(process.argv[2]);
const size = BigInt((await file.stat()).size);
const readable = {
  size: async () => size,
  read: async (offset, length) => {
    const bytes = new Uint8Array(Number(length));
    await file.read(bytes, 0, Number(length), Number(offset));
    return bytes;
  },
};
const decompressHandlers = { zstd: (bytes, length) => decompress(bytes, new Uint8Array(Number(length))) };
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
const messages = {};
for await (const message of reader.readMessages()) {
  const { topic } = reader.channelsById.get(message.channelId);
  messages[topic] = (messages[topic] ?? 0) + 1;
}
const attachments = [];
for await (const attachment of reader.readAttachments()) attachments.push(attachment.name);
console.log(JSON.stringify({ messages, attachments }));
await file.close();
