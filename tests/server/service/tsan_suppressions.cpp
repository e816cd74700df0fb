// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// An exception that threads share is counted by libstdc++.so, which isn't compiled for ThreadSanitizer: it sees the
// last owner free the exception but not the atomic count that makes this safe.
//
// ConnectionTable looks at descriptors that others close, and notices by the socket's identity: connection_table.h.

extern "C" const char* __tsan_default_suppressions() {
  return "race:std::__exception_ptr::exception_ptr::_M_release\n"
         "race:ccslice::server::ConnectionTable::forget_left\n";
}
