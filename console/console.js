"use strict";
const kPaths = ["/api/v1/stop", "/api/v1/events"];
