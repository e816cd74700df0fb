// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The HTTP interface of `ccslice view`, docs/view_api.md.

/** The answer. Throws an Error with the server's message, and the status where there was an answer. */
export async function call(path, options = {}) {
  const response = await fetch(path, { credentials: "same-origin", ...options });
  if (response.ok) return response;
  let message = response.statusText;
  try {
    message = (await response.json()).error.message;
  } catch {
    // No answer of ours.
  }
  throw Object.assign(new Error(message), { status: response.status });
}

export const post = (path, body) =>
  call(path, { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) });

/** Whether an error says that the server isn't there, so that it may be back soon. */
export const is_away = (error) => error.status === undefined || error.status === 503;
