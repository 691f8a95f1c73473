// Photos on their way to the computer, one after the other; what cannot be sent waits to be sent again.

export class Uploads {
  limit = Infinity;
  /** { file, share: 0 to 1, failed: a sentence, again: does another try make sense?, progressed(share) } */
  pending = [];
  #changed;
  #sending = false;

  /** changed: called whenever `pending` is another. */
  constructor(changed) {
    this.#changed = changed;
  }

  add(files) {
    this.pending.push(...files.map((file) => ({ file, share: 0, failed: null, again: false, progressed() {} })));
    this.#send();
  }

  retry(upload) {
    upload.failed = null;
    this.#send();
  }

  forget(upload) {
    this.pending.splice(this.pending.indexOf(upload), 1);
    this.#changed();
  }

  async #send() {
    this.#changed();
    if (this.#sending) return;
    this.#sending = true;
    for (let upload; (upload = this.pending.find(({ failed }) => !failed)); this.#changed()) {
      if (upload.file.size > this.limit) {
        upload.failed = `${upload.file.name} is too large; at most ${Math.floor(this.limit / 1e6)} MB can be sent. Save it as JPEG.`;
        continue;
      }
      try {
        await this.#post(upload);
        this.pending.splice(this.pending.indexOf(upload), 1);
      } catch (error) {
        upload.failed = error.message;
      }
    }
    this.#sending = false;
  }

  #post(upload) {
    const request = new XMLHttpRequest(); // fetch tells nothing of how much has been sent
    request.open("POST", `/api/photos?name=${encodeURIComponent(upload.file.name)}`);
    request.responseType = "json";
    request.upload.onprogress = ({ loaded, total }) => {
      upload.share = total ? loaded / total : 0;
      upload.progressed(upload.share);
    };
    return new Promise((done, failed) => {
      request.onload = () => {
        upload.again = request.status >= 500 || request.status === 409;
        if (request.status === 202) done();
        else failed(new Error(request.response?.detail ?? "The computer refused it."));
      };
      request.onerror = () => {
        upload.again = true;
        failed(new Error("It could not be sent; see that the phone is in the computer's network."));
      };
      request.send(upload.file);
    });
  }
}
