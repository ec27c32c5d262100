#pragma once

/// On the namespace of a public header: what is declared there can be used from outside of a shared library,
/// and its exceptions and types are the same on both sides. All else is hidden.
#define ITS_API [[gnu::visibility("default")]]
