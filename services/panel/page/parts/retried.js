/**
 * Fetches a script. A browser may keep for an address that it could not be had, so each try after one that failed has an
 * address of its own, which ends with the query.
 *
 * @template Script
 * @param {(query: string) => Promise<Script>} fetches
 * @returns {() => Promise<Script>}
 */
export function retried(fetches) {
  let failures = 0;
  return async () => {
    try {
      return await fetches(failures ? `?${failures}` : "");
    } catch (error) {
      failures += 1;
      throw error;
    }
  };
}
