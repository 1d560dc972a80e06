// Validates the glTF files that are named and prints, as JSON, what the Khronos validator says of each.

import { readFileSync } from "node:fs";
import { basename } from "node:path";
import validator from "gltf-validator";

const reports = [];
for (const path of process.argv.slice(2)) {
  const bytes = new Uint8Array(readFileSync(path));
  const name = basename(path);
  // All messages, not the first hundred.
  const report = await validator.validateBytes(bytes, { uri: name, maxIssues: 0, writeTimestamp: false });
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  reports.push({
    file: name,
    bytes: bytes.length,
    errors: numErrors,
    warnings: numWarnings,
    notes: numInfos + numHints,
    vertices: report.info?.totalVertexCount ?? 0,
    triangles: report.info?.totalTriangleCount ?? 0,
    messages: messages.map(({ code, severity, pointer, message }) => ({ code, severity, pointer, message })),
  });
}
console.log(JSON.stringify({ validator: validator.version(), reports }));
