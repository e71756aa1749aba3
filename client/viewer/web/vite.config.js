import { defineConfig } from 'vite';

// Relative addresses, so that the page works behind any path; no source maps: the sources are small and here.
export default defineConfig({ base: './', build: { target: 'es2020', chunkSizeWarningLimit: 900 } });
