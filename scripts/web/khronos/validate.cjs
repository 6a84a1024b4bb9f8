// SPDX-License-Identifier: GPL-3.0-or-later
// Prints what Khronos' validator has to say of each of the files that it is given, as JSON.

const fs = require("fs")
const path = require("path")
const validator = require("gltf-validator")

const bytes = (file) => new Uint8Array(fs.readFileSync(file))

async function messages(file) {
  const externalResourceFunction = async (uri) => bytes(path.join(path.dirname(file), decodeURIComponent(uri)))
  const report = await validator.validateBytes(bytes(file), { externalResourceFunction, maxIssues: 0 })
  return report.issues.messages
}

Promise.all(process.argv.slice(2).map(messages)).then((found) => console.log(JSON.stringify(found)))
