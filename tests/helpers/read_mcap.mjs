// Reads an MCAP file as Foxglove does: every message of every topic, by the definitions that stand in the file.
import { McapIndexedReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import zstd from "@foxglove/wasm-zstd";
import { open } from "node:fs/promises";

await zstd.isLoaded;
const file = await open(process.argv[2]);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, size) => {
    const bytes = new Uint8Array(Number(size));
    await file.read(bytes, 0, Number(size), Number(offset));
    return bytes;
  },
};
const decompressHandlers = { zstd: (bytes, size) => zstd.decompress(bytes, Number(size)) };
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
const channels = new Map();
for (const [id, channel] of reader.channelsById) {
  const text = new TextDecoder().decode(reader.schemasById.get(channel.schemaId).data);
  channels.set(id, [channel.topic, new MessageReader(parse(text, { ros2: true }))]);
}
const topics = {};
for await (const message of reader.readMessages()) {
  const [topic, decoder] = channels.get(message.channelId);
  const decoded = decoder.readMessage(message.data);
  const found = (topics[topic] ??= { count: 0, first_ns: message.logTime, effort: [], text: [] });
  found.count += 1;
  if (decoded.effort) found.effort.push(Array.from(decoded.effort));
  if (decoded.msg) found.text.push(decoded.msg);
}
console.log(JSON.stringify(topics, (key, value) => (typeof value === "bigint" ? value.toString() : Number.isNaN(value) ? null : value)));
