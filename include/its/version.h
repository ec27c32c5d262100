#pragma once

// The only place that states the version; CMake and the tools read it from here.
#define ITS_VERSION_MAJOR 0
#define ITS_VERSION_MINOR 1
#define ITS_VERSION_PATCH 0
#define ITS_VERSION "0.1.0"
